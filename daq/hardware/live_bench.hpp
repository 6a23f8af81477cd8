// The bench over its real transports: Net Box over UDP and HTTP, motor module over a serial line, a steady clock.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "daq/bench/air_source.hpp"
#include "daq/bench/bench.hpp"
#include "daq/bench/device_records.hpp"
#include "daq/guard/interlock.hpp"
#include "daq/hardware/live_supply.hpp"
#include "daq/hardware/terminal_watch.hpp"
#include "daq/sentinel/sentinel.hpp"
#include "drivers/iq/link/motor.hpp"
#include "drivers/netbox/configuration/settings.hpp"
#include "drivers/netbox/receive/load_cell.hpp"

namespace kphi::daq {

class LiveMotor final : public MotorLink {
 public:
  /// Connects and reads the module's parameters. Throws DeviceError, Interrupted.
  LiveMotor(const profiles::MotorConfig& config, const Clock& clock, const StopAsked& stop_asked);
  void rest() override;
  void wake(const StopAsked& stop_asked) override;
  void spin_at(RadPerSec signed_speed) override { connected().spin_at(signed_speed); }
  void renew() noexcept override;
  void emergency_stop() noexcept override;
  void begin_stop(const iq::StopSettings& settings) override;
  [[nodiscard]] std::optional<iq::StopReport> stop_report() override;
  [[nodiscard]] const iq::AuditRecord& parameters() const override { return parameters_; }
  [[nodiscard]] std::optional<Celsius> coil_temperature() override;
  std::size_t take(std::span<MotorReading> out) override;
  [[nodiscard]] std::vector<StreamEvent> take_events() override;
  [[nodiscard]] std::string failure() const override;
  [[nodiscard]] results::MotorCounts counts() const override;
  [[nodiscard]] std::string identity() const override { return identity_; }

 private:
  /// Throws DeviceError while it rests.
  [[nodiscard]] iq::Motor& connected() const;
  [[nodiscard]] std::unique_ptr<iq::Motor> connect(const StopAsked& stop_asked) const;

  const profiles::MotorConfig config_;
  const Clock& clock_;
  std::unique_ptr<iq::Motor> owned_, closed_;  ///< the runner's; closed_: another thread may still be at it
  std::atomic<iq::Motor*> motor_{nullptr};     ///< null while it rests; for any thread
  std::string identity_;
  iq::AuditRecord parameters_;
  std::optional<std::uint64_t> stop_;  ///< its ticket
  std::optional<iq::StopReport> stop_report_;
};

class LiveLoadCell final : public LoadCellLink {
 public:
  /// Applies the settings of the bench file, reads the configuration, checks it against the one over TCP, reads the
  /// page of its calibration. The destructor, or the next program, restores the box's settings. Throws DeviceError,
  /// Interrupted.
  LiveLoadCell(profiles::NetBoxConfig config, const Clock& clock, const std::function<bool()>& stop_asked);
  [[nodiscard]] results::LoadCellScale scale() const override { return to_scale(cell_->configuration()); }
  [[nodiscard]] const netbox::Configuration* box() const override { return &cell_->configuration(); }
  [[nodiscard]] std::vector<Finding> findings() const override { return findings_; }
  results::LoadCellScale start() override;
  void stop() noexcept override { cell_->stop(); }
  std::size_t take(std::span<LoadCellRecord> out) override { return cell_->take(out); }
  [[nodiscard]] std::vector<StreamEvent> take_events() override { return to_events(cell_->take_events()); }
  [[nodiscard]] std::string page() override;
  void set_bias() noexcept override { cell_->set_bias(); }
  [[nodiscard]] std::string failure() const override;
  [[nodiscard]] SampleAccount account() const override { return cell_->counters().account(); }
  [[nodiscard]] StreamHealth health() const override { return cell_->health(); }

 private:
  profiles::NetBoxConfig config_;
  const Clock& clock_;
  netbox::SettingsKeeper settings_;
  std::unique_ptr<netbox::LoadCell> cell_;  ///< of the present or last run
  std::vector<Finding> findings_;
  std::string slots_json_;
};

/// Power for the motor module alone, so that it can be asked who it is: the supply's output is on while this lives, and
/// a sentinel switches it off if this program dies.
class ModulePower {
 public:
  /// Throws DeviceError, also for a supply that no sentinel can switch off; Interrupted, with the output off again.
  ModulePower(const profiles::BenchConfig& config, const Clock& clock, const StopAsked& stop_asked);
  /// Empty, or why the output may still be on.
  [[nodiscard]] std::string off() noexcept { return supply_.switch_off(); }

 private:
  LiveSupply supply_;
  Sentinel sentinel_;
  MotorPower on_;
};

class LiveBench final : public Bench {
 public:
  /// Finds all devices; switches the supply on once the others have answered, unless `stop_asked`. Throws DeviceError,
  /// Interrupted.
  LiveBench(const profiles::BenchConfig& config, const std::function<bool()>& stop_asked);
  [[nodiscard]] const Clock& clock() const override { return clock_; }
  [[nodiscard]] MotorLink& motor() override { return *motor_; }
  [[nodiscard]] LoadCellLink& load_cell() override { return *load_cell_; }
  [[nodiscard]] SupplyLink* supply() override { return supply_.get(); }
  [[nodiscard]] std::optional<ambient::Density> air() const override { return air_.density(); }
  void wait_until(Instant when) override;
  [[nodiscard]] std::shared_ptr<void> run_periodically(const ThreadRole& role, std::function<void()> work) override;
  [[nodiscard]] results::FileLayer& files() override { return results::disk(); }
  [[nodiscard]] Duration sync_interval() const override;
  [[nodiscard]] std::string unprotected() const override { return sentinel_.failure(); }
  [[nodiscard]] Duration serial_late() const noexcept override { return terminals_.late(); }
  [[nodiscard]] std::vector<StreamEvent> take_news() override;
  void mounted(const std::string& propeller_id, double occlusion_deg) override;
  void hung(int axis, double newtons) override;
  [[nodiscard]] bool switch_off_power() override { return power_.off(*motor_); }
  void restore_power(const StopAsked& stop_asked) override;
  [[nodiscard]] std::shared_ptr<void> keep_awake(std::string& why_not) override;
  [[nodiscard]] std::shared_ptr<void> keep_prompt(std::string& why_not) override;

 private:
  /// To the control line of a simulated bench that has one. Throws DeviceError.
  void tell_simulation(const std::string& line);
  /// The last check before its output comes on. Throws Interrupted, SafetyStop.
  [[nodiscard]] SupplyLink* supply_to_switch_on(const std::function<bool()>& stop_asked);
  /// Of whatever kind. What it throws says, too, if its supply has not confirmed that it is off again.
  [[nodiscard]] std::unique_ptr<MotorLink> connect_motor_with_power(const StopAsked& stop_asked);

  profiles::BenchConfig config_;
  SteadyClock clock_;
  TerminalWatch terminals_;
  AirSource air_;
  std::unique_ptr<LoadCellLink> load_cell_;
  std::unique_ptr<LiveSupply> supply_;
  Sentinel sentinel_;  ///< from before anything has power until nothing has
  MotorPower power_;   ///< made before the motor, which needs it to answer; destroyed after it
  std::unique_ptr<MotorLink> motor_;
};

}  // namespace kphi::daq
