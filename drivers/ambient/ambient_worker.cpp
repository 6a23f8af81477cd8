#include "drivers/ambient/ambient_worker.hpp"

#include <algorithm>
#include <utility>

#include "base/error.hpp"
#include "base/thread.hpp"

namespace kphi::ambient {

AmbientWorker::AmbientWorker(Open open, const Clock& clock, const Rhythm& rhythm)
    : open_(std::move(open)), clock_(clock), rhythm_(rhythm), thread_(start_thread([this] { run(); })) {}

AmbientWorker::~AmbientWorker() {
  {
    const std::lock_guard lock(mutex_);
    stop_asked_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::optional<AirReading> AmbientWorker::newest() const {
  const std::lock_guard lock(mutex_);
  if (!newest_) return std::nullopt;
  AirReading reading = *newest_;
  reading.age = clock_.now() - reading.at;
  return reading;
}

std::string AmbientWorker::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

std::string AmbientWorker::identity() const {
  const std::lock_guard lock(mutex_);
  return identity_;
}

AmbientWorker::Counters AmbientWorker::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

bool AmbientWorker::wait_for_first(Duration wall) const {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, wall, [&] { return newest_.has_value(); });
}

void AmbientWorker::run() noexcept {
  std::unique_ptr<Ambient> sensor;
  Duration pause = rhythm_.first_pause;
  Duration rest{0};
  while (!stopped_within(rest)) {
    if (look(sensor)) {
      rest = rhythm_.between_readings;
      pause = rhythm_.first_pause;
    } else {
      rest = std::exchange(pause, std::min(2 * pause, rhythm_.longest_pause));
    }
  }
}

/// False: the sensor failed and is closed.
bool AmbientWorker::look(std::unique_ptr<Ambient>& sensor) noexcept {
  std::string why;
  try {
    look_once(sensor);
    return true;
  } catch (const std::exception& error) {
    why = error.what();
  } catch (...) {
    why = "an unknown failure";
  }
  sensor.reset();
  const std::lock_guard lock(mutex_);
  failure_ = std::move(why);
  ++counters_.failures;
  changed_.notify_all();
  return false;
}

void AmbientWorker::look_once(std::unique_ptr<Ambient>& sensor) {
  if (!sensor) {
    sensor = open_();
    if (!sensor) throw DeviceError("ambient", "open", "there is no sensor");
    const std::lock_guard lock(mutex_);
    identity_ = sensor->identity();
    ++counters_.openings;
  }
  const Air air = sensor->read();
  const std::lock_guard lock(mutex_);
  newest_ = AirReading{air, clock_.now(), Duration{0}};
  failure_.clear();
  ++counters_.readings;
  changed_.notify_all();
}

bool AmbientWorker::stopped_within(Duration wall) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, wall, [&] { return stop_asked_; });
}

}  // namespace kphi::ambient
