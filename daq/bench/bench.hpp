// The bench as runner and guard see it. Two exist: the live one (real transports, threads, a steady clock) and the
// deterministic one (sessions joined to simulated devices in virtual time, one thread). Runner and guard cannot tell
// them apart.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/finding.hpp"
#include "base/thread.hpp"
#include "compensation/units.hpp"
#include "daq/bench/stop_asked.hpp"
#include "drivers/ambient/air.hpp"
#include "drivers/iq/session/stopping.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "profiles/bench_config.hpp"
#include "results/file_layer.hpp"
#include "results/records.hpp"

namespace kphi {

/// For nlohmann::json.
template <class Json>
void to_json(Json& json, const Finding& finding) {
  json = {{"severity", name_of(finding.severity)}, {"what", finding.what}, {"next_move", finding.next_move}};
}

}  // namespace kphi

namespace kphi::daq {

class OutputEnable;

/// The supply did not confirm switch_off().
inline constexpr const char* kNotOff = "supply: output NOT confirmed off, it may be ON; cut the 12 V at the switch";

/// Only OutputEnable can switch the output on; its destructor switches it off.
class SupplyLink {
 public:
  virtual ~SupplyLink() = default;
  /// One line: model, serial, firmware, and where.
  [[nodiscard]] virtual std::string identity() const = 0;
  /// Takes its readings since the last call. The guard's thread.
  virtual std::size_t take(std::span<SupplyReading> out) = 0;
  /// Why the link failed; empty while it works. Thread-safe.
  [[nodiscard]] virtual std::string failure() const = 0;
  /// Where it is not free, nobody should count on its output key.
  [[nodiscard]] virtual SupplyKeypad keypad() const { return SupplyKeypad::free; }
  /// Bench time that the longest reading so far took; 0: unknown, or none to speak of. Thread-safe.
  [[nodiscard]] virtual Duration longest_reading() const noexcept { return Duration(0); }
  /// Output off. Thread-safe; does not wait.
  virtual void cut() noexcept = 0;
  /// Output off, and waits until the supply confirms it. Returns why it may still be on; empty: it is off.
  [[nodiscard]] virtual std::string switch_off() noexcept = 0;

 private:
  friend class OutputEnable;
  /// Sets and verifies the limits, then switches the output on; returns once the voltage is there. Throws DeviceError,
  /// Interrupted.
  virtual void switch_on(const StopAsked& stop_asked) = 0;
};

/// The motor has power while this lives.
class [[nodiscard]] OutputEnable {
 public:
  OutputEnable(SupplyLink& supply, const StopAsked& stop_asked) : supply_(supply) {
    try {
      supply_.switch_on(stop_asked);
    } catch (...) {
      (void)supply_.switch_off();
      throw;
    }
  }
  ~OutputEnable() { (void)supply_.switch_off(); }
  OutputEnable(const OutputEnable&) = delete;
  OutputEnable& operator=(const OutputEnable&) = delete;

 private:
  SupplyLink& supply_;
};

/// The motor. Turn it only through MotorEnable (guard/guard.hpp), whose destructor coasts it. A driver coasts by itself
/// once neither spin_at() nor renew() was called for its lease (kMotorLease), and so does the device once its driver is
/// silent.
class MotorLink {
 public:
  virtual ~MotorLink() = default;
  /// Positive = counter-clockwise. Also renews the lease without which the driver coasts the motor by itself.
  virtual void spin_at(RadPerSec signed_speed) = 0;
  virtual void renew() noexcept = 0;
  /// Sends the order to coast three times at once, also when the link has failed.
  virtual void emergency_stop() noexcept = 0;
  /// Coasts and closes the link, before its power is cut. Until wake() only calls of the guard's thread may follow.
  virtual void rest() {}
  /// Connects again, to the same module. Throws DeviceError, Interrupted.
  virtual void wake(const StopAsked&) {}
  /// Ramps down, coasts and watches until the rotor is at rest; returns at once. Ignored while another stop is under
  /// way.
  virtual void begin_stop(const iq::StopSettings& settings) = 0;
  /// How the last stop ended; nullopt while it is under way or before the first.
  [[nodiscard]] virtual std::optional<iq::StopReport> stop_report() = 0;
  /// The parameters of an IQ module as read when the link was made; without a value: another kind of motor.
  [[nodiscard]] virtual const iq::AuditRecord& parameters() const {
    static const iq::AuditRecord kNone;
    return kNone;
  }
  /// Findings of connecting; faults throw instead.
  [[nodiscard]] virtual std::vector<Finding> findings() const { return {}; }
  /// Reads it now; nullopt if the module reports none. Throws DeviceError. The runner's thread.
  [[nodiscard]] virtual std::optional<Celsius> coil_temperature() { return std::nullopt; }
  /// Takes the readings since the last call. The guard's thread.
  virtual std::size_t take(std::span<MotorReading> out) = 0;
  /// Events of the module and its line since the last call, oldest first. The guard's thread.
  [[nodiscard]] virtual std::vector<StreamEvent> take_events() = 0;
  /// Why the link failed; empty while it works. Thread-safe.
  [[nodiscard]] virtual std::string failure() const = 0;
  /// Since the link was made. Thread-safe.
  [[nodiscard]] virtual results::MotorCounts counts() const = 0;
  /// One line: firmware, hardware, uid.
  [[nodiscard]] virtual std::string identity() const = 0;
};

/// The load cell's stream. Every run starts a new one, with counters at zero.
class LoadCellLink {
 public:
  virtual ~LoadCellLink() = default;
  /// As last read: when the link was made, or at start(). An axis that the cell does not have has range 0 and counts 0.
  [[nodiscard]] virtual results::LoadCellScale scale() const = 0;
  /// The Net Box behind it, as last read, likewise; nullptr: another kind of load cell.
  [[nodiscard]] virtual const netbox::Configuration* box() const { return nullptr; }
  /// Samples that arrive at once.
  [[nodiscard]] virtual int records_together() const { return box() != nullptr ? box()->records_per_datagram : 1; }
  /// Findings of connecting, worst first; faults throw instead.
  [[nodiscard]] virtual std::vector<Finding> findings() const { return {}; }
  /// Reads the configuration and starts the stream. Throws DeviceError.
  virtual results::LoadCellScale start() = 0;
  virtual void stop() noexcept = 0;
  /// Takes the samples since the last call. The guard's thread.
  virtual std::size_t take(std::span<LoadCellRecord> out) = 0;
  /// Events of the stream since the last call, oldest first. The guard's thread.
  [[nodiscard]] virtual std::vector<StreamEvent> take_events() = 0;
  /// The box's present netftapi2.xml. The runner's thread. Throws DeviceError. Only of a Net Box.
  [[nodiscard]] virtual std::string page() { return {}; }
  /// Sets the box's bias: its present load becomes zero; the stream continues. The runner's thread. Only of a Net Box.
  virtual void set_bias() noexcept {}
  /// Why the stream failed; empty while it works. Thread-safe.
  [[nodiscard]] virtual std::string failure() const = 0;
  [[nodiscard]] virtual SampleAccount account() const = 0;
  [[nodiscard]] virtual StreamHealth health() const = 0;
};

/// One run, before it begins.
struct RunBeginning {
  double occlusion_deg = 0;
  int repetition = 1;
  bool mounted_anew = true;  ///< false: as the other runs of this occlusion are
  Instant after{0};  ///< bench time at which the campaign's last run was accepted, also before a resumption; 0: none
};

class Bench {
 public:
  virtual ~Bench() = default;
  [[nodiscard]] virtual const Clock& clock() const = 0;
  [[nodiscard]] virtual MotorLink& motor() = 0;
  [[nodiscard]] virtual LoadCellLink& load_cell() = 0;
  /// nullptr: kphi does not control the motor's power. Otherwise the motor is powered while the bench lives.
  [[nodiscard]] virtual SupplyLink* supply() { return nullptr; }
  /// Current air density; nullopt if unknown.
  [[nodiscard]] virtual std::optional<ambient::Density> air() const { return std::nullopt; }
  /// Returns at bench time `when`, or a little later on a live bench.
  virtual void wait_until(Instant when) = 0;
  /// Calls `work` while the handle lives: from a thread of its own, or from within wait_until.
  [[nodiscard]] virtual std::shared_ptr<void> run_periodically(const ThreadRole& role, std::function<void()> work) = 0;
  /// Why nothing would switch the devices off if this program were killed: then nothing may turn, and nobody may come
  /// near. Empty: something would. Thread-safe.
  [[nodiscard]] virtual std::string unprotected() const { return {}; }
  /// By how much this computer hands on too late what its serial ports hear, wall time. Thread-safe.
  [[nodiscard]] virtual Duration serial_late() const noexcept { return Duration(0); }
  /// Events of the bench itself since the last call. The guard's thread.
  [[nodiscard]] virtual std::vector<StreamEvent> take_news() { return {}; }
  /// Writes the run files.
  [[nodiscard]] virtual results::FileLayer& files() = 0;
  /// How often the recorder syncs the run file, bench time.
  [[nodiscard]] virtual Duration sync_interval() const = 0;
  /// A run begins; a bench in virtual time may be made again for it, which invalidates references to its parts.
  virtual void begin_run(const RunBeginning&) {}
  /// Before anybody comes near: cuts the motor's power if kphi controls it, and waits until the supply confirms it. The
  /// motor must be at rest. False: the motor still has power. Throws SafetyStop.
  [[nodiscard]] virtual bool switch_off_power() = 0;
  /// After everybody has stepped back: restores the power, and connects to the module again if it was lost. Throws
  /// DeviceError, SafetyStop, Interrupted.
  virtual void restore_power(const StopAsked& stop_asked) = 0;
  /// Keeps this computer awake while the handle lives; `why_not` becomes one line if that is impossible.
  [[nodiscard]] virtual std::shared_ptr<void> keep_awake(std::string& why_not) {
    why_not.clear();
    return nullptr;
  }
  /// Gives the calling thread real-time priority while the handle lives, which must not compute for long; `why_not`
  /// becomes one line if this computer grants none.
  [[nodiscard]] virtual std::shared_ptr<void> keep_prompt(std::string& why_not) {
    why_not.clear();
    return nullptr;
  }
  /// Tells a simulated bench what was mounted. Throws DeviceError.
  virtual void mounted(const std::string& propeller_id, double occlusion_deg) = 0;
  /// Tells a simulated bench which force a weight has along an axis of the cell (0..2), N; 0: it was taken off. Throws
  /// DeviceError.
  virtual void hung(int axis, double newtons) = 0;
};

/// Connects to the devices of the bench file. `stop_asked` is checked before anything is switched on. Throws
/// DeviceError, Interrupted.
[[nodiscard]] std::unique_ptr<Bench> connect(
    const profiles::BenchConfig& bench, const std::function<bool()>& stop_asked = [] { return false; });

}  // namespace kphi::daq
