#include "drivers/ambient/ambient_worker.hpp"

#include <algorithm>
#include <utility>

#include "base/error.hpp"
#include "base/thread.hpp"

namespace kphi::ambient {

AmbientWorker::AmbientWorker(Open open, const Clock& clock, const Rhythm& rhythm)
    : open_(std::move(open)), clock_(clock), rhythm_(rhythm), thread_(start_thread({"air"}, [this] { run(); })) {}

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

bool AmbientWorker::wait_for_first(Duration wall) const {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, wall, [&] { return newest_.has_value(); });
}

void AmbientWorker::run() noexcept {
  std::unique_ptr<Ambient> sensor;
  Duration pause = rhythm_.first_pause;
  Duration rest{0};
  while (!stopped_within(rest)) {
    std::optional<Air> air;
    std::string why;
    try {
      if (!sensor) sensor = open_();
      if (!sensor) throw DeviceError("ambient", "open", "no sensor found");
      air = sensor->read();
      rest = rhythm_.between_readings;
      pause = rhythm_.first_pause;
    } catch (const std::exception& error) {
      why = error.what();
    } catch (...) {
      why = "an unknown failure";
    }
    if (!air) {
      sensor.reset();
      rest = std::exchange(pause, std::min(2 * pause, rhythm_.longest_pause));
    }
    const std::lock_guard lock(mutex_);
    if (air) newest_ = AirReading{*air, clock_.now(), Duration{0}};
    failure_ = std::move(why);
    changed_.notify_all();
  }
}

bool AmbientWorker::stopped_within(Duration wall) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, wall, [&] { return stop_asked_; });
}

}  // namespace kphi::ambient
