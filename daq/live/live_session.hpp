// The live view that `--live` and `--udp-json` ask for, and the progress that feeds it.
#pragma once

#include <exception>
#include <memory>
#include <optional>
#include <string>

#include "daq/guard/run_stopped.hpp"
#include "daq/live/feed.hpp"
#include "daq/live/messages.hpp"
#include "daq/live/server.hpp"
#include "daq/live/udp_json.hpp"
#include "daq/run/progress.hpp"

namespace kphi::daq::live {

/// Preliminary k of a step, for the page.
class QuickLook {
 public:
  static constexpr int kBlocks = 5;

  void begin() { *this = {}; }
  void add(Newtons thrust, RadPerSec speed) {
    thrusts_n_.push_back(thrust.value());
    speeds_squared_.push_back(speed.value() * speed.value());
  }
  [[nodiscard]] StepFigures result() const;

 private:
  std::vector<double> thrusts_n_, speeds_squared_;
};

class LiveProgress final : public Progress {
 public:
  /// All must outlive this. `inner` gets every call first; `plotter` may be nullptr.
  LiveProgress(Progress& inner, Feed& feed, UdpJson* plotter, const Subject& subject, const Clock& clock)
      : inner_(inner), feed_(feed), plotter_(plotter), subject_(subject), clock_(clock) {}
  void guarded(const std::vector<GuardLimit>& limits) override;
  void tick(const Position& position, const Observation& seen) override;
  void step_done(const Position& position, const Observation& seen) override;
  void say(const std::string& line) override;
  void asks(const StandQuestion& question) override;
  void reached(const std::string& words) override;

 private:
  void add_to_step(const Position& position, const Observation& seen, Instant now);

  Progress& inner_;
  Feed& feed_;
  UdpJson* plotter_;
  const Subject& subject_;
  const Clock& clock_;
  QuickLook quick_look_;
  int step_ = -1;
  Instant step_began_{};
};

struct LiveOptions {
  std::optional<std::uint16_t> port;  ///< of the page; 0: any that is free
  std::string udp_json;               ///< HOST:PORT; empty: no plotter
  [[nodiscard]] bool any() const { return port || !udp_json.empty(); }
};

class LiveSession {
 public:
  /// The page can be opened as soon as this returns. Throws ConfigurationError.
  LiveSession(const LiveOptions& options, Subject subject);

  /// Address of the page, with the token; empty without a page.
  [[nodiscard]] std::string url() const { return server_ ? server_->url() : std::string(); }
  /// STOP was pressed on a page. Thread-safe.
  [[nodiscard]] bool stop_asked() const noexcept { return feed_.stop_asked(); }
  /// A key that a page pressed. The runner's thread.
  [[nodiscard]] std::optional<Key> take_key() noexcept { return feed_.take_key(); }
  /// A page is open. Thread-safe.
  [[nodiscard]] bool is_watched() const noexcept { return server_ && server_->clients() > 0; }
  /// A progress for `behind` and the live view. `behind`, `clock` and this must outlive it.
  [[nodiscard]] std::unique_ptr<Progress> beside(Progress& behind, const Clock& clock);

  /// Does the work, and shows its end on the pages: in these words, which the work may set, or those of its exception.
  template <class Work>
  auto tell_the_end(Work&& work, const std::string& words = "finished") {
    try {
      auto result = work();
      end(true, !subject_.replay, words);
      return result;
    } catch (const std::exception& e) {
      end(false, words_of(std::current_exception()).at_rest, e.what());
      throw;
    }
  }

 private:
  void end(bool well, bool at_rest, const std::string& words);

  Subject subject_;
  Feed feed_;
  const Clock* clock_ = nullptr;  ///< of the run; nullptr before it
  std::unique_ptr<UdpJson> plotter_;
  std::unique_ptr<Server> server_;  ///< last member: it reads the others
};

}  // namespace kphi::daq::live
