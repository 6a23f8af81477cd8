// The state of the air, read every few seconds by a thread of its own; callers get the newest reading with its age and
// never wait. A sensor that fails is closed and opened again, after increasing pauses.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "base/clock.hpp"
#include "drivers/ambient/air.hpp"

namespace kphi::ambient {

/// Wall time, also on a simulated bench: its air does not change faster.
struct Rhythm {
  Duration between_readings = std::chrono::seconds(5);
  Duration first_pause = std::chrono::seconds(1);  ///< after a failure; each further one doubles it
  Duration longest_pause = std::chrono::seconds(30);
};

struct AirReading {
  Air air;
  Instant at{0};    ///< bench time of its end
  Duration age{0};  ///< bench time since then
};

class AmbientWorker {
 public:
  /// Called on the worker's thread; throws DeviceError when the sensor is not there.
  using Open = std::function<std::unique_ptr<Ambient>()>;

  /// Opens nothing yet; `clock` must outlive this.
  AmbientWorker(Open open, const Clock& clock, const Rhythm& rhythm = {});
  /// Waits for a reading in progress: 0.2 s, or some seconds if the bridge no longer answers.
  ~AmbientWorker();

  // Any thread; they do not wait.
  /// nullopt before the first reading. After a failure of the sensor it stays and ages.
  [[nodiscard]] std::optional<AirReading> newest() const;
  /// Why there is no newer reading; empty while the sensor works.
  [[nodiscard]] std::string failure() const;
  /// Waits at most `wall` for the first reading; false: no reading yet, see failure(). For the check before a run.
  [[nodiscard]] bool wait_for_first(Duration wall) const;

 private:
  void run() noexcept;
  [[nodiscard]] bool stopped_within(Duration wall);

  const Open open_;
  const Clock& clock_;
  const Rhythm rhythm_;

  // Shared by callers and the thread; locked only while copying, never during traffic.
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  bool stop_asked_ = false;
  std::optional<AirReading> newest_;
  std::string failure_ = "not measured yet";

  std::thread thread_;
};

}  // namespace kphi::ambient
