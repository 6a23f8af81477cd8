// The bench as runner and recorder see it. Two exist: the live one (real transports, threads, a steady clock) and the
// deterministic one (sessions joined to simulated devices in virtual time, one thread). Neither runner nor recorder
// can tell them apart.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compensation/units.hpp"
#include "daq/supply_link.hpp"
#include "drivers/ambient/air.hpp"
#include "drivers/clock.hpp"
#include "drivers/iq/audit.hpp"
#include "drivers/iq/stopping.hpp"
#include "drivers/netbox/configuration.hpp"
#include "drivers/netbox/finding.hpp"
#include "profiles/bench.hpp"
#include "results/records.hpp"
#include "results/run_writer.hpp"

namespace kphi::daq {

/// Work that is called again and again until this goes.
class Background {
 public:
  virtual ~Background() = default;
};

/// The motor. Whoever wants it to turn does so through Spin (spin.hpp), which cannot forget to let go.
class MotorLink {
 public:
  virtual ~MotorLink() = default;
  /// Positive = counter-clockwise. Also renews the lease without which the driver coasts the motor by itself.
  virtual void spin_at(RadPerSec signed_speed) = 0;
  virtual void renew() noexcept = 0;
  /// Coasts, three times at once; also when the link is gone, as far as can be.
  virtual void emergency_stop() noexcept = 0;
  /// Begins to ramp down and to coast, and to watch it to the end; returns at once. Ignored while another is under way.
  virtual void begin_stop(const iq::StopSettings& settings) = 0;
  /// How the last of them ended; nothing while it is under way, or before the first.
  [[nodiscard]] virtual std::optional<iq::StopReport> stop_report() = 0;
  /// What the module told of itself when the link was made.
  [[nodiscard]] virtual const iq::AuditRecord& parameters() const = 0;
  /// Asks for it now; nothing when the module tells none. Throws DeviceError. The runner's thread.
  [[nodiscard]] virtual std::optional<Celsius> coil_temperature() = 0;
  /// Takes what the module reported since the last call. The guard's thread.
  virtual std::size_t take(std::span<results::MotorReading> out) = 0;
  /// What happened to the module and its line since the last call, oldest first. The guard's thread.
  [[nodiscard]] virtual std::vector<results::StreamEvent> take_events() = 0;
  /// Why the link is dead; empty while it lives. Any thread.
  [[nodiscard]] virtual std::string failure() const = 0;
  /// One line: firmware, hardware, uid.
  [[nodiscard]] virtual std::string identity() const = 0;
};

/// The load cell's stream. A fresh one for every run: counters start at zero with it.
class LoadCellLink {
 public:
  virtual ~LoadCellLink() = default;
  /// As read last: when the link was made, or at start().
  [[nodiscard]] virtual const netbox::Configuration& configuration() const = 0;
  /// What making the link found besides, worst first; no faults: these throw.
  [[nodiscard]] virtual std::vector<netbox::Finding> findings() const = 0;
  /// Reads the box's configuration and starts the stream. Throws DeviceError.
  virtual results::LoadCellScale start() = 0;
  virtual void stop() noexcept = 0;
  /// Takes what came since the last call. The guard's thread.
  virtual std::size_t take(std::span<results::LoadCellRecord> out) = 0;
  /// What happened to the stream since the last call, oldest first. The guard's thread.
  [[nodiscard]] virtual std::vector<results::StreamEvent> take_events() = 0;
  /// netftapi2.xml of the box as it is now. The runner's thread. Throws DeviceError.
  [[nodiscard]] virtual std::string page() = 0;
  /// Tells the box to take its present load as zero; the stream goes on. The runner's thread.
  virtual void set_bias() noexcept = 0;
  /// Why the stream is dead; empty while it lives. Any thread.
  [[nodiscard]] virtual std::string failure() const = 0;
  [[nodiscard]] virtual results::SampleAccount account() const = 0;
  [[nodiscard]] virtual results::StreamHealth health() const = 0;
};

/// Of one run, before anything of it happens.
struct RunBeginning {
  double occlusion_deg = 0;
  int repetition = 1;
  Instant after{0};  ///< bench time when the campaign's last run was accepted, be it by another program; 0: none was
};

class Bench {
 public:
  virtual ~Bench() = default;
  [[nodiscard]] virtual const Clock& clock() const = 0;
  [[nodiscard]] virtual MotorLink& motor() = 0;
  [[nodiscard]] virtual LoadCellLink& load_cell() = 0;
  /// nullptr: what powers the motor is not ours to switch. Else the motor is powered while the bench lives.
  [[nodiscard]] virtual SupplyLink* supply() { return nullptr; }
  /// Of the air, now; nothing: nobody knows it.
  [[nodiscard]] virtual std::optional<ambient::Density> air() const { return std::nullopt; }
  /// Returns at bench time `when`, or a little later on a live bench.
  virtual void wait_until(Instant when) = 0;
  /// Calls `work` until the handle goes: from a thread of its own, or from within wait_until.
  [[nodiscard]] virtual std::unique_ptr<Background> keep_calling(std::function<void()> work) = 0;
  /// Through which run files go to disk.
  [[nodiscard]] virtual results::FileLayer& files() = 0;
  /// How often the recorder secures the run file, bench time.
  [[nodiscard]] virtual Duration sync_interval() const = 0;
  /// A run begins; a bench in virtual time may begin anew with it. References to its parts may die.
  virtual void begin_run(const RunBeginning&) {}
  /// Somebody is about to come near: takes the power from the motor where its supply is ours, and waits until the
  /// supply confirms that. The motor must be at rest. False: the motor has power as before. Throws SafetyStop.
  [[nodiscard]] virtual bool unpower() = 0;
  /// Nobody is near any more: gives it back, and connects to the module again if it was lost. Throws DeviceError.
  virtual void repower() = 0;
  /// Keeps this computer from sleeping while the handle lives; `why_not` becomes one line when it cannot.
  [[nodiscard]] virtual std::shared_ptr<void> keep_awake(std::string& why_not) {
    why_not.clear();
    return nullptr;
  }
  /// Tells whoever must know what a person has mounted (a simulated bench). Throws DeviceError.
  virtual void mounted(const std::string& propeller_id, double occlusion_deg) = 0;
};

/// Connects to the devices that the file names. `stop_asked` is asked before anything is switched on. Throws
/// DeviceError, Interrupted.
[[nodiscard]] std::unique_ptr<Bench> connect(
    const profiles::Bench& bench, const std::function<bool()>& stop_asked = [] { return false; });

}  // namespace kphi::daq
