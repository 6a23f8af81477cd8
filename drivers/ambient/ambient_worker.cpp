#include "drivers/ambient/ambient_worker.hpp"

#include <algorithm>
#include <utility>

#include "base/error.hpp"
#include "base/thread.hpp"

namespace kphi::ambient {

AmbientWorker::AmbientWorker(Open open, const Clock& clock, const Rhythm& rhythm)
    : clock_(clock),
      shared_(std::make_shared<Shared>(std::move(open), clock, rhythm)),
      thread_(start_thread({"air"}, [shared = shared_] { shared->run(); })) {}

AmbientWorker::~AmbientWorker() {
  std::unique_lock lock(shared_->mutex);
  shared_->stop_asked = true;
  shared_->changed.notify_all();
  const bool ended = shared_->changed.wait_for(lock, kPatience, [&] { return shared_->ended; });
  lock.unlock();
  if (ended)
    thread_.join();
  else
    thread_.detach();
}

std::optional<AirReading> AmbientWorker::newest() const {
  const std::lock_guard lock(shared_->mutex);
  if (!shared_->newest) return std::nullopt;
  AirReading reading = *shared_->newest;
  reading.age = clock_.now() - reading.at;
  return reading;
}

std::string AmbientWorker::failure() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->failure;
}

bool AmbientWorker::wait_for_first(Duration wall) const {
  std::unique_lock lock(shared_->mutex);
  return shared_->changed.wait_for(lock, wall, [&] { return shared_->newest.has_value(); });
}

void AmbientWorker::Shared::run() noexcept {
  std::unique_ptr<Ambient> sensor;
  Duration pause = rhythm.first_pause;
  Duration rest{0};
  while (!stopped_within(rest)) {
    std::optional<Air> air;
    std::string why;
    try {
      if (!sensor) sensor = open();
      if (!sensor) throw DeviceError("ambient", "open", "no sensor found");
      air = sensor->read();
      rest = rhythm.between_readings;
      pause = rhythm.first_pause;
    } catch (const std::exception& error) {
      why = error.what();
    } catch (...) {
      why = "an unknown failure";
    }
    if (!air) {
      sensor.reset();
      rest = std::exchange(pause, std::min(2 * pause, rhythm.longest_pause));
    }
    const std::lock_guard lock(mutex);
    if (stop_asked) break;
    if (air) newest = AirReading{*air, clock->now(), Duration{0}};
    failure = std::move(why);
    changed.notify_all();
  }
  sensor.reset();
  const std::lock_guard lock(mutex);
  ended = true;
  changed.notify_all();
}

bool AmbientWorker::Shared::stopped_within(Duration wall) {
  std::unique_lock lock(mutex);
  return changed.wait_for(lock, wall, [&] { return stop_asked; });
}

}  // namespace kphi::ambient
