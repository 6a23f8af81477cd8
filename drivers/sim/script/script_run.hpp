// A script of faults in progress: which are active, how often each has acted, and which begins or ends next. Seeded:
// the same calls give the same draws.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "base/clock.hpp"
#include "base/random.hpp"
#include "drivers/sim/script/faults.hpp"

namespace kphi::sim {

/// One thread.
class ScriptRun {
 public:
  struct Event {
    Instant at;
    std::size_t fault;
    bool begins;
  };

  ScriptRun(FaultScript faults, std::uint64_t seed)
      : faults_(std::move(faults)), used_(faults_.size(), 0), random_(seed) {}

  [[nodiscard]] std::size_t size() const noexcept { return faults_.size(); }
  [[nodiscard]] const Fault& operator[](std::size_t i) const noexcept { return faults_[i]; }
  [[nodiscard]] const FaultScript& faults() const noexcept { return faults_; }
  /// One more fault, without events.
  void add(const Fault& fault) {
    faults_.push_back(fault);
    used_.push_back(0);
  }

  [[nodiscard]] bool active(std::size_t i, Instant at) const noexcept { return faults_[i].active(at, used_[i]); }
  /// It has acted once more.
  void use(std::size_t i) noexcept { ++used_[i]; }
  [[nodiscard]] bool unused(std::size_t i) const noexcept { return used_[i] == 0; }
  /// The first active fault for which `fits(const Fault&)` is true, by its probability; counts it. nullptr: none.
  template <class Fits>
  const Fault* strike(Instant at, Fits&& fits) {
    for (std::size_t i = 0; i < faults_.size(); ++i) {
      if (!active(i, at) || !fits(faults_[i]) || !draws(i)) continue;
      use(i);
      return &faults_[i];
    }
    return nullptr;
  }
  template <class Fits>
  [[nodiscard]] bool any_active(Instant at, Fits&& fits) const {
    for (std::size_t i = 0; i < faults_.size(); ++i)
      if (active(i, at) && fits(faults_[i])) return true;
    return false;
  }

  /// 0..1
  [[nodiscard]] double uniform() noexcept { return 0.5 * (random_.symmetric() + 1); }
  [[nodiscard]] bool chance(double p) noexcept { return uniform() < p; }
  [[nodiscard]] std::uint64_t bits() noexcept { return random_.bits(); }

  /// Plans beginning and end of fault `i`, and at one time in the order of the calls: a beginning comes before its end.
  void plan(std::size_t i) {
    plan({faults_[i].at, i, true});
    if (faults_[i].end() != kNever) plan({faults_[i].end(), i, false});
  }
  void plan(const Event& event) {
    events_.insert(std::find_if(events_.begin(), events_.end(), [&](const Event& e) { return e.at <= event.at; }),
                   event);
  }
  /// kNever: none is left.
  [[nodiscard]] Instant next_event() const noexcept { return events_.empty() ? kNever : events_.back().at; }
  /// Takes the next event if it is due.
  [[nodiscard]] std::optional<Event> take_event(Instant now) {
    if (next_event() > now || events_.empty()) return std::nullopt;
    const Event event = events_.back();
    events_.pop_back();
    return event;
  }

 private:
  [[nodiscard]] bool draws(std::size_t i) noexcept { return faults_[i].p >= 1 || chance(faults_[i].p); }

  FaultScript faults_;
  std::vector<std::uint64_t> used_;
  std::vector<Event> events_;  ///< latest first
  Random random_;
};

}  // namespace kphi::sim
