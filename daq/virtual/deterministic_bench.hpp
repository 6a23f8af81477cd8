// The bench in virtual time: driver sessions joined to simulated devices without transports, one thread, one seed.
// The same campaign gives the same bytes, and takes seconds; also when a script spoils the wires of its devices.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "daq/bench/air.hpp"
#include "daq/bench/bench.hpp"
#include "daq/guard/interlock.hpp"
#include "daq/virtual/deterministic_air.hpp"
#include "daq/virtual/deterministic_motor.hpp"
#include "daq/virtual/deterministic_supply.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/stream/connection.hpp"
#include "drivers/sim/bench.hpp"

namespace kphi::daq {

/// Who looks at a bench from outside while a program drives it. What is empty is not called.
struct BenchWitness {
  std::function<void()> stepped;       ///< after every step of bench time; what it throws leaves through whoever waits
  std::function<void()> stream_began;  ///< a fresh session of the load cell
  /// What reached that session; `discarded`: it belonged to no stream of its own.
  std::function<void(const sim::Datagram& datagram, bool discarded)> heard;
};

class DeterministicBench final : public Bench, private LoadCellLink {
 public:
  /// Throws DeviceError; ConfigurationError when a script or motor that the file names cannot be used.
  /// `other`: what no bench file says of the simulated devices.
  explicit DeterministicBench(const profiles::BenchConfig& config, const sim::BenchSettings& other = {});
  [[nodiscard]] const Clock& clock() const override { return clock_; }
  [[nodiscard]] MotorLink& motor() override { return motor_; }
  [[nodiscard]] LoadCellLink& load_cell() override { return *this; }
  [[nodiscard]] SupplyLink* supply() override { return supply_.get(); }
  [[nodiscard]] std::optional<ambient::Density> air() const override {
    return measured_air_ ? measured_air_->density() : air_.density();
  }
  void wait_until(Instant when) override;
  [[nodiscard]] std::unique_ptr<Background> run_periodically(std::function<void()> work) override;
  [[nodiscard]] results::FileLayer& files() override { return *files_; }
  [[nodiscard]] Duration sync_interval() const override;
  void mounted(const std::string& propeller_id, double occlusion_deg) override;
  [[nodiscard]] bool switch_off_power() override { return power_.off(motor_); }
  void restore_power() override;

  /// What a fault test looks at, and where it puts its finger.
  [[nodiscard]] sim::SimulatedBench& simulation() noexcept { return sim_; }
  void use_files(results::FileLayer& files) noexcept { files_ = &files; }
  void let_watch(BenchWitness witness) { witness_ = std::move(witness); }
  /// The program is gone, as after kill -9: from here on nothing it does reaches a device.
  void abandon() noexcept;
  /// This computer sleeps for so long, and its clock can tell. `each` is called after every millisecond of it. From
  /// within wait_until, or between two.
  void sleep(Duration lasts, const std::function<void()>& each = {});
  /// The devices by themselves until `when`.
  void outlive(Instant when);

 private:
  [[nodiscard]] const netbox::Configuration& configuration() const override { return configuration_; }
  [[nodiscard]] std::vector<Finding> findings() const override { return findings_; }
  results::LoadCellScale start() override;
  void stop() noexcept override;
  std::size_t take(std::span<results::LoadCellRecord> out) override;
  [[nodiscard]] std::vector<results::StreamEvent> take_events() override;
  [[nodiscard]] std::string page() override { return page("/netftapi2.xml"); }
  void set_bias() noexcept override;
  [[nodiscard]] results::SampleAccount account() const override;
  [[nodiscard]] results::StreamHealth health() const override;
  [[nodiscard]] std::string failure() const override;

  [[nodiscard]] std::string page(const std::string& target);
  void read_box();
  void cross_check();
  void ask_box();
  void step_to(Instant when);
  void exchange();
  void exchange_load_cell();

  ManualClock clock_;
  AirSource air_;  ///< as a person has read it off
  std::optional<DeterministicAir> measured_air_;
  results::MemoryOnlySync own_files_;
  results::FileLayer* files_ = &own_files_;
  sim::SimulatedBench sim_;
  std::unique_ptr<DeterministicSupply> supply_;
  MotorPower power_;
  DeterministicMotor motor_;
  netbox::Configuration configuration_;
  std::vector<Finding> findings_;
  std::string slots_json_;
  std::optional<netbox::Connection> connection_;  ///< of the present or last run
  std::optional<netbox::Answer> answer_;          ///< of the box, on its way
  Instant answer_due_{};
  std::vector<netbox::StampedRecord> records_;
  std::vector<std::function<void()>*> work_;  ///< in the order in which it was given
  Instant next_work_{};
  BenchWitness witness_;
  bool abandoned_ = false;
};

}  // namespace kphi::daq
