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
  /// Waits for a reading in progress and until the sensor is closed, 0.2 s, but no longer than `kPatience`: some
  /// bridges take eleven seconds to close, and go on with that alone.
  ~AmbientWorker();
  static constexpr Duration kPatience = std::chrono::seconds(1);

  // Any thread; they do not wait.
  /// nullopt before the first reading. After a failure of the sensor it stays and ages.
  [[nodiscard]] std::optional<AirReading> newest() const;
  /// Why there is no newer reading; empty while the sensor works.
  [[nodiscard]] std::string failure() const;
  /// Waits at most `wall` for the first reading; false: no reading yet, see failure(). For the check before a run.
  [[nodiscard]] bool wait_for_first(Duration wall) const;

 private:
  /// What callers and the thread share; the thread may outlive the worker.
  struct Shared {
    Shared(Open how, const Clock& time, const Rhythm& beat) : open(std::move(how)), clock(&time), rhythm(beat) {}
    const Open open;
    const Clock* clock;  ///< only while nobody has asked to stop
    const Rhythm rhythm;
    // Locked only while copying, never during traffic.
    std::mutex mutex;
    std::condition_variable changed;
    bool stop_asked = false, ended = false;
    std::optional<AirReading> newest;
    std::string failure = "not measured yet";

    void run() noexcept;
    [[nodiscard]] bool stopped_within(Duration wall);
  };

  const Clock& clock_;
  const std::shared_ptr<Shared> shared_;
  std::thread thread_;
};

}  // namespace kphi::ambient
