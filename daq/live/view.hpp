// What `--live` and `--udp-json` ask for, and all of it while it lives.
#pragma once

#include <exception>
#include <memory>
#include <optional>
#include <string>

#include "daq/live/feed.hpp"
#include "daq/live/server.hpp"
#include "daq/live/subject.hpp"
#include "daq/live/udp_json.hpp"
#include "daq/progress.hpp"

namespace kphi::daq::live {

struct Wishes {
  std::optional<std::uint16_t> port;  ///< of the page; 0: any that is free
  std::string udp_json;               ///< HOST:PORT; empty: no plotter
  [[nodiscard]] bool any() const { return port || !udp_json.empty(); }
};

class View {
 public:
  /// The page can be opened as soon as this returns. Throws ConfigurationError.
  View(const Wishes& wishes, Subject subject);

  /// Where the page is, with the token; empty without one.
  [[nodiscard]] std::string url() const { return server_ ? server_->url() : std::string(); }
  /// Somebody pressed STOP. Any thread.
  [[nodiscard]] bool stop_asked() const noexcept { return feed_.stop_asked(); }
  /// Somebody looks on. Any thread.
  [[nodiscard]] bool is_watched() const noexcept { return server_ && server_->counts().clients > 0; }
  /// What tells `behind` and the onlookers; both, this and `clock` must outlive it.
  [[nodiscard]] std::unique_ptr<Progress> beside(Progress& behind, const Clock& clock);

  /// Does the work and tells the onlookers how it ended.
  template <class Work>
  auto tell_the_end(Work&& work) {
    try {
      auto result = work();
      end(true, "finished");
      return result;
    } catch (const std::exception& e) {
      end(false, e.what());
      throw;
    }
  }

 private:
  void end(bool well, const std::string& words);

  Subject subject_;
  Feed feed_;
  const Clock* clock_ = nullptr;  ///< of who is told; nullptr: nobody yet
  std::unique_ptr<UdpJson> plotter_;
  std::unique_ptr<Server> server_;  ///< goes first: it reads all else
};

}  // namespace kphi::daq::live
