// Sends the progress to live pages and plotters, too. The runner's thread; nothing here waits.
#pragma once

#include <string>

#include "daq/live/feed.hpp"
#include "daq/live/quick_look.hpp"
#include "daq/live/subject.hpp"
#include "daq/live/udp_json.hpp"
#include "daq/run/progress.hpp"

namespace kphi::daq::live {

class LiveProgress final : public Progress {
 public:
  /// All must outlive this. `inner` gets every call first; `plotter` may be nullptr.
  LiveProgress(Progress& inner, Feed& feed, UdpJson* plotter, const Subject& subject, const Clock& clock)
      : inner_(inner), feed_(feed), plotter_(plotter), subject_(subject), clock_(clock) {}
  void guarded(const std::vector<GuardLimit>& limits) override;
  void tick(const Position& position, const Observation& seen) override;
  void step_done(const Position& position, const Observation& seen) override;
  void say(const std::string& line) override;

 private:
  [[nodiscard]] Tick tick_of(const Position& position, const Observation& seen);
  void add_to_step(const Position& position, const Observation& seen, Instant now);
  [[nodiscard]] bool is_settled(Instant now) const;

  Progress& inner_;
  Feed& feed_;
  UdpJson* plotter_;
  const Subject& subject_;
  const Clock& clock_;
  QuickLook quick_look_;
  int step_ = -1;
  Instant step_began_{};
  double most_remaining_s_ = 0;
};

}  // namespace kphi::daq::live
