// The bench in virtual time: driver sessions joined to simulated devices without transports, one thread, one seed.
// The same campaign gives the same bytes, and takes seconds; also when a script spoils the wires of its devices.
//
// Devices that live for one run are made again for every run: a run then depends on the seed, its occlusion, its
// repetition and the bench time at which it begins, but not on earlier runs. So a campaign that was killed and resumed
// gives the same bytes as an uninterrupted one. The price: every run begins with a cold motor and its own zero.
#pragma once

#include <list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daq/bench/air_source.hpp"
#include "daq/bench/bench.hpp"
#include "daq/bench/device_records.hpp"
#include "daq/guard/interlock.hpp"
#include "daq/virtual/deterministic_air.hpp"
#include "daq/virtual/deterministic_motor.hpp"
#include "daq/virtual/deterministic_supply.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/stream/connection.hpp"
#include "drivers/sim/simulated_bench.hpp"

namespace kphi::daq {

/// Who looks at a bench from outside while a program drives it. What is empty is not called.
struct BenchWitness {
  std::function<void()> stepped;       ///< after every step of bench time; what it throws leaves through whoever waits
  std::function<void()> stream_began;  ///< a fresh session of the load cell
  /// What reached that session; `discarded`: it belonged to no stream of its own.
  std::function<void(const sim::Datagram& datagram, bool discarded)> heard;
};

/// The simulated devices of a bench file, its fault script and motor included. `other`: what no bench file says of
/// them. `repetition`: of the run that they live for; 0: the whole campaign. Throws ConfigurationError when script or
/// motor cannot be used.
[[nodiscard]] sim::BenchSettings simulated_devices(const profiles::BenchConfig& config, sim::BenchSettings other = {},
                                                   int repetition = 0);

class DeterministicBench final : public Bench, private LoadCellLink {
 public:
  /// How long its devices live.
  enum class Lives : std::uint8_t { whole_campaign, one_run };
  /// See simulated_devices(). Throws DeviceError, too.
  explicit DeterministicBench(const profiles::BenchConfig& config, const sim::BenchSettings& other = {},
                              Lives lives = Lives::whole_campaign);
  void begin_run(const RunBeginning& run) override;
  [[nodiscard]] const Clock& clock() const override { return clock_; }
  [[nodiscard]] MotorLink& motor() override { return *motor_; }
  [[nodiscard]] LoadCellLink& load_cell() override { return *this; }
  [[nodiscard]] SupplyLink* supply() override { return supply_ ? &*supply_ : nullptr; }
  [[nodiscard]] std::optional<ambient::Density> air() const override {
    return measured_air_ ? measured_air_->density() : air_.density();
  }
  void wait_until(Instant when) override;
  [[nodiscard]] std::shared_ptr<void> run_periodically(const ThreadRole&, std::function<void()> work) override;
  [[nodiscard]] results::FileLayer& files() override { return *files_; }
  [[nodiscard]] Duration sync_interval() const override { return std::chrono::seconds(1); }
  void mounted(const std::string& propeller_id, double occlusion_deg) override;
  void hung(int axis, double newtons) override;
  [[nodiscard]] bool switch_off_power() override { return power_->off(*motor_); }
  void restore_power(const StopAsked& stop_asked) override;

  /// What a fault test looks at, and where it puts its finger.
  [[nodiscard]] sim::SimulatedBench& simulation() noexcept { return *sim_; }
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
  [[nodiscard]] results::LoadCellScale scale() const override { return to_scale(configuration_); }
  [[nodiscard]] const netbox::Configuration* box() const override { return &configuration_; }
  [[nodiscard]] std::vector<Finding> findings() const override { return findings_; }
  results::LoadCellScale start() override;
  void stop() noexcept override;
  std::size_t take(std::span<LoadCellRecord> out) override { return connection_->take(out); }
  [[nodiscard]] std::vector<StreamEvent> take_events() override { return to_events(connection_->take_events()); }
  [[nodiscard]] std::string page() override { return page("/netftapi2.xml"); }
  void set_bias() noexcept override;
  [[nodiscard]] SampleAccount account() const override { return connection_->counters().account(); }
  [[nodiscard]] StreamHealth health() const override { return connection_->health(); }
  [[nodiscard]] std::string failure() const override;

  [[nodiscard]] std::string page(const std::string& target);
  /// Replaces them.
  void make_devices(const sim::BenchSettings& settings);
  void read_box() { configuration_ = netbox::parse_configuration(page()); }
  void cross_check();
  void ask_box();
  void step_to(Instant when);
  void exchange();
  void exchange_load_cell();

  const profiles::BenchConfig config_;
  const sim::BenchSettings other_;
  const Lives lives_;
  ManualClock clock_;
  AirSource air_;  ///< as a person has read it off
  std::optional<DeterministicAir> measured_air_;
  results::MemoryOnlySync own_files_;
  results::FileLayer* files_ = &own_files_;
  std::optional<sim::SimulatedBench> sim_;
  std::optional<DeterministicSupply> supply_;
  std::optional<MotorPower> power_;
  std::optional<DeterministicMotor> motor_;
  std::optional<std::pair<std::string, double>> mounted_;
  netbox::Configuration configuration_;
  std::vector<Finding> findings_;
  std::string slots_json_;
  std::optional<netbox::Connection> connection_;  ///< of the present or last run
  std::optional<netbox::Answer> answer_;          ///< of the box, on its way
  Instant answer_due_{};
  std::list<std::function<void()>> work_;  ///< in the order in which it was given
  Instant next_work_{};
  BenchWitness witness_;
  bool abandoned_ = false;
};

}  // namespace kphi::daq
