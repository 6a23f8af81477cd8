// The bench over its real transports: Net Box over UDP and HTTP, motor module over a serial line, a steady clock.
#pragma once

#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <vector>

#include "daq/air.hpp"
#include "daq/bench.hpp"
#include "daq/device_records.hpp"
#include "daq/live_supply.hpp"
#include "drivers/iq/motor.hpp"
#include "drivers/netbox/load_cell.hpp"
#include "drivers/netbox/settings.hpp"

namespace kphi::daq {

class LiveMotor final : public MotorLink {
 public:
  /// Connects and reads the module's parameters. Throws DeviceError.
  LiveMotor(const profiles::MotorPlace& place, const Clock& clock);
  /// Coasts and closes the link: its power is about to go. Only wake() and the other thread's calls may follow.
  void rest();
  /// Connects again, to the same module. Throws DeviceError.
  void wake();
  void spin_at(RadPerSec signed_speed) override;
  void renew() noexcept override;
  void emergency_stop() noexcept override;
  void begin_stop(const iq::StopSettings& settings) override;
  [[nodiscard]] std::optional<iq::StopReport> stop_report() override;
  [[nodiscard]] const iq::AuditRecord& parameters() const override { return parameters_; }
  [[nodiscard]] std::optional<Celsius> coil_temperature() override;
  std::size_t take(std::span<results::MotorReading> out) override;
  [[nodiscard]] std::vector<results::StreamEvent> take_events() override;
  [[nodiscard]] std::string failure() const override;
  [[nodiscard]] std::string identity() const override { return identity_; }

 private:
  [[nodiscard]] std::shared_ptr<iq::Motor> motor() const noexcept { return std::atomic_load(&motor_); }
  [[nodiscard]] std::shared_ptr<iq::Motor> connected() const;
  [[nodiscard]] std::shared_ptr<iq::Motor> connect() const;

  const profiles::MotorPlace place_;
  const Clock& clock_;
  std::shared_ptr<iq::Motor> motor_;  ///< null while it rests; looked at by any thread
  std::string identity_;
  iq::AuditRecord parameters_;
  std::vector<iq::Reading> readings_;
  std::optional<iq::StopReport> stop_report_;
  std::future<iq::StopReport> stop_;  ///< goes first: it waits for the stop that it is
};

class LiveLoadCell final : public LoadCellLink {
 public:
  /// Sets the box as the bench file wants it, reads the configuration, holds it against what TCP says, reads the pages
  /// of all slots. The box's settings come back when this dies, or when the next program starts. `stop_asked` is asked
  /// before each page. Throws DeviceError, Interrupted.
  LiveLoadCell(profiles::NetBoxPlace place, const Clock& clock, const std::function<bool()>& stop_asked);
  [[nodiscard]] const netbox::Configuration& configuration() const override { return cell_->configuration(); }
  [[nodiscard]] std::vector<netbox::Finding> findings() const override { return findings_; }
  results::LoadCellScale start() override;
  void stop() noexcept override;
  std::size_t take(std::span<results::LoadCellRecord> out) override;
  [[nodiscard]] std::vector<results::StreamEvent> take_events() override;
  [[nodiscard]] std::string page() override;
  void set_bias() noexcept override { cell_->set_bias(); }
  [[nodiscard]] std::string failure() const override;
  [[nodiscard]] results::SampleAccount account() const override;
  [[nodiscard]] results::StreamHealth health() const override { return to_health(cell_->health(), clock_); }

 private:
  profiles::NetBoxPlace place_;
  const Clock& clock_;
  netbox::SettingsKeeper settings_;
  std::unique_ptr<netbox::LoadCell> cell_;  ///< of the present or last run
  std::vector<netbox::StampedRecord> records_;
  std::vector<netbox::Finding> findings_;
  std::string slots_json_;
};

class LiveBench final : public Bench {
 public:
  /// Finds all devices, and switches the supply on once the others have answered and `stop_asked` denies; throws
  /// DeviceError, Interrupted.
  LiveBench(const profiles::Bench& place, const std::function<bool()>& stop_asked);
  [[nodiscard]] const Clock& clock() const override { return clock_; }
  [[nodiscard]] MotorLink& motor() override { return motor_; }
  [[nodiscard]] LoadCellLink& load_cell() override { return load_cell_; }
  [[nodiscard]] SupplyLink* supply() override { return supply_.get(); }
  [[nodiscard]] std::optional<ambient::Density> air() const override { return air_.density(); }
  void wait_until(Instant when) override;
  [[nodiscard]] std::unique_ptr<Background> keep_calling(std::function<void()> work) override;
  [[nodiscard]] results::FileLayer& files() override { return results::disk(); }
  [[nodiscard]] Duration sync_interval() const override;
  void mounted(const std::string& propeller_id, double occlusion_deg) override;
  [[nodiscard]] bool unpower() override;
  void repower() override;
  [[nodiscard]] std::shared_ptr<void> keep_awake(std::string& why_not) override;

 private:
  [[nodiscard]] std::unique_ptr<Powered> power(const std::function<bool()>& stop_asked);

  profiles::Bench place_;
  SteadyClock clock_;
  AirSource air_;
  LiveLoadCell load_cell_;
  std::unique_ptr<LiveSupply> supply_;
  std::unique_ptr<Powered> powered_;  ///< before the motor, which needs it to answer; goes after it
  LiveMotor motor_;
};

}  // namespace kphi::daq
