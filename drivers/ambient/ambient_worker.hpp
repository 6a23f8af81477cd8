// The state of the air, asked every few seconds by a thread of its own, and the newest answer with its age. A sensor
// that fails is closed and opened again, after longer and longer pauses; nobody else ever waits for it.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "drivers/ambient/ambient.hpp"
#include "drivers/clock.hpp"

namespace kphi::ambient {

/// Wall time: the air of a bench does not change faster because it is simulated.
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
  /// Waits for a reading under way: 0.2 s when all is well, some seconds when the bridge no longer answers.
  ~AmbientWorker();
  AmbientWorker(const AmbientWorker&) = delete;
  AmbientWorker& operator=(const AmbientWorker&) = delete;

  // Any thread; they wait for nothing.
  /// Nothing before the first reading. Stays when the sensor fails: its age tells.
  [[nodiscard]] std::optional<AirReading> newest() const;
  /// Why there is no fresher reading; empty while all is well.
  [[nodiscard]] std::string failure() const;
  /// Of the sensor that was last open; empty before.
  [[nodiscard]] std::string identity() const;
  struct Counters {
    std::uint64_t readings = 0, failures = 0, openings = 0;
  };
  [[nodiscard]] Counters counters() const;

  /// Waits until there is a reading or `wall` has passed; false: none yet, see failure(). For preflight.
  [[nodiscard]] bool wait_for_first(Duration wall) const;

 private:
  void run() noexcept;
  [[nodiscard]] bool look(std::unique_ptr<Ambient>& sensor) noexcept;
  void look_once(std::unique_ptr<Ambient>& sensor);
  [[nodiscard]] bool stopped_within(Duration wall);

  const Open open_;
  const Clock& clock_;
  const Rhythm rhythm_;

  // Callers of any thread and the worker's own meet here; held for copies only, never during traffic.
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  bool stop_asked_ = false;
  std::optional<AirReading> newest_;
  std::string failure_ = "not measured yet", identity_;
  Counters counters_;

  std::thread thread_;
};

}  // namespace kphi::ambient
