#include "daq/virtual/deterministic_bench.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <stdexcept>

#include "base/error.hpp"
#include "base/random.hpp"
#include "daq/bench/box.hpp"
#include "drivers/netbox/configuration/calinfo.hpp"
#include "drivers/sim/input_files.hpp"
#include "profiles/strict_yaml.hpp"

namespace kphi::daq {
namespace {

constexpr Duration kHandshake = std::chrono::seconds(5);
constexpr Duration kSupplyRises = std::chrono::milliseconds(500);
constexpr Duration kWorkEvery = std::chrono::milliseconds(5);
constexpr Duration kHttpTimeout = std::chrono::seconds(5);
constexpr Duration kMotorWait = std::chrono::milliseconds(1);
constexpr sim::Peer kHost = 1;
constexpr std::uint64_t kStandStream = 0x5851f42d'4c957f2dull;

/// Neighbouring keys give unrelated streams.
std::uint64_t mixed(std::uint64_t key) noexcept { return SplitMix64(key)(); }

/// What this stand has and the next one, of another seed, has not: gain of its cell, clock of its motor.
void take_scatter(const profiles::SimulatedStand& stand, std::uint64_t seed, sim::BenchSettings& settings) {
  Random random(mixed(seed ^ kStandStream));
  settings.plant.load_cell.gain *= 1 + stand.cell_gain_scatter * random.normal();
  settings.oscillator_gain += stand.clock_scatter * random.normal();
}

/// Of one repetition; 0: of all. `plant` has the law of the nominal propellers.
void take_stand(const profiles::SimulatedStand& stand, int repetition, sim::PlantParameters& plant) {
  if (stand.law) plant.stand.law = {stand.law->K_T, stand.law->intercept, stand.law->slope_per_deg};
  plant.stand.bend = stand.bend;
  plant.stand.rise_per_krad_s = stand.rise_per_krad_s;
  plant.stand.mounting = stand.mounting;
  for (const auto& plate : stand.plates)
    if (plate.repetition.value_or(repetition) == repetition)
      plant.stand.plates.push_back({plate.named_deg, plate.true_deg});
  if (stand.zero_walk_n) plant.load_cell.walk_per_root_minute[2] = *stand.zero_walk_n;
  plant.load_cell.slow_noise = stand.slow_noise_n;
  plant.load_cell.slow_noise_seconds = stand.slow_noise_s;
  plant.load_cell.gain = stand.cell_gain;
  plant.load_cell.hysteresis = stand.cell_hysteresis;
}

/// Throws DeviceError, as the true transport would.
std::string body_of(const std::string& response, const std::string& operation) {
  const std::size_t blank = response.find("\r\n\r\n");
  const std::string status = response.substr(0, response.find("\r\n"));
  if (blank == std::string::npos) throw DeviceError("Net Box", operation, "the answer is cut short");
  if (status.find(" 200 ") == std::string::npos) throw DeviceError("Net Box", operation, "the box answers: " + status);
  return response.substr(blank + 4);
}

}  // namespace

sim::BenchSettings simulated_devices(const profiles::BenchConfig& config, sim::BenchSettings settings, int repetition) {
  settings.netbox.rate_hz = config.netbox.rate_hz;
  settings.netbox.records_per_datagram = config.netbox.records_per_datagram;
  settings.module.module_id = config.iq.module_id;
  settings.module.baud = config.iq.baud;
  if (config.supply) settings.supply.emplace();
  if (!config.simulation) return settings;
  settings.seed = config.simulation->seed;
  settings.plant.air_density_kg_m3 = config.simulation->air_density_kg_m3;
  take_stand(config.simulation->stand, repetition, settings.plant);
  settings.plant.stand.spin = config.iq.spin;
  take_scatter(config.simulation->stand, config.simulation->seed, settings);
  const std::string &faults = config.simulation->faults, &motor = config.simulation->motor;
  if (!faults.empty()) sim::load_faults(profiles::read_text(faults), faults, settings);
  if (!motor.empty()) {
    const sim::MotorProfile profile = sim::parse_motor_profile(profiles::read_text(motor), motor);
    settings.plant.motor = profile.motor;
    settings.module.sensors = profile.sensors;
  }
  return settings;
}

DeterministicBench::DeterministicBench(const profiles::BenchConfig& config, const sim::BenchSettings& other,
                                       Lives lives)
    : config_(config),
      other_(other),
      lives_(lives),
      air_({.sensor = "", .u_temperature_c = {}, .manual = config.ambient.manual}, clock_) {
  if (config.simulation && config.simulation->durable) files_ = &results::disk();
  make_devices(simulated_devices(config_, other_));
}

void DeterministicBench::make_devices(const sim::BenchSettings& settings) {
  connection_.reset();
  answer_.reset();
  motor_.reset();
  power_.reset();
  supply_.reset();
  clock_.set(settings.begin);
  next_work_ = {};
  sim_.emplace(settings);
  if (config_.supply) supply_.emplace(*config_.supply, *sim_->supply(), clock_);
  power_.emplace(supply(), [] { return false; });
  motor_.emplace(config_.iq, sim_->motor_line(), clock_, [this] { step_to(clock_.now() + kMotorWait); });
  if (supply_) {
    clock_.set(clock_.now() + kSupplyRises);
    sim_->advance(clock_.now());
  }
  if (!config_.ambient.sensor.empty()) measured_air_.emplace(clock_, settings.air, settings.faults, config_.ambient);
  motor_->connect();
  read_box();
  cross_check();
  CalibrationPage calibration =
      read_calibration_page([this](const std::string& target) { return page(target); }, configuration_.calibration);
  slots_json_ = std::move(calibration.json);
  findings_ = std::move(calibration.findings);
}

void DeterministicBench::begin_run(const RunBeginning& run) {
  if (lives_ == Lives::whole_campaign) return;
  sim::BenchSettings settings = simulated_devices(config_, other_, run.repetition);
  settings.begin = run.after;
  const std::uint64_t of_occlusion = mixed(mixed(settings.seed) ^ std::bit_cast<std::uint64_t>(run.occlusion_deg));
  settings.seed = mixed(of_occlusion ^ static_cast<std::uint64_t>(run.repetition));
  if (!run.mounted_anew) settings.plant.stand.mounting_seed = of_occlusion;
  make_devices(settings);
  if (mounted_) sim_->mount(mounted_->first, mounted_->second);
}

std::string DeterministicBench::page(const std::string& target) {
  const std::string operation = "GET " + target;
  if (sim_->wire().http_refused(clock_.now())) throw DeviceError("Net Box", operation, "connection refused");
  const sim::StreamReply reply = sim_->wire().http(operation + " HTTP/1.0\r\n\r\n", clock_.now());
  if (reply.wait > kHttpTimeout) throw DeviceError("Net Box", operation, "no answer in time");
  wait_until(clock_.now() + reply.wait);
  return body_of(reply.bytes, operation);
}

void DeterministicBench::cross_check() {
  const auto request = netbox::encode_read_calinfo();
  std::string received(request.begin(), request.end());
  const std::string answer = sim_->wire().tcp(received, clock_.now()).bytes;
  const auto calinfo = netbox::decode_calinfo({reinterpret_cast<const std::uint8_t*>(answer.data()), answer.size()});
  if (!calinfo) throw DeviceError("Net Box", "read the calibration over TCP", "unexpected reply: not a Net Box");
  if (const auto finding = netbox::compare(*calinfo, configuration_))
    throw DeviceError("Net Box", "compare its scale", finding->what, finding->next_move);
}

void DeterministicBench::wait_until(Instant when) {
  const Duration datagram = from_seconds(40.0 / 7000.0);
  while (clock_.now() < when) {
    Instant next = std::min(when, clock_.now() + datagram);
    next = std::min(next, motor_->deadline());
    if (connection_) next = std::min({next, connection_->deadline(), sim_->wire().next_arrival()});
    if (answer_) next = std::min(next, answer_due_);
    step_to(std::max(next, clock_.now() + Duration(1)));
    if (clock_.now() >= next_work_) {
      for (const auto& work : work_) work();
      next_work_ = clock_.now() + kWorkEvery;
    }
  }
}

void DeterministicBench::step_to(Instant when) {
  clock_.set(when);
  sim_->advance(when);
  if (supply_) supply_->look();
  if (measured_air_) measured_air_->look();
  exchange();  // what came is received before anything is found to be late
  motor_->advance(when);
  if (connection_) connection_->advance(when);
  exchange();
  if (witness_.stepped) witness_.stepped();
}

void DeterministicBench::exchange() {
  motor_->exchange();
  exchange_load_cell();
}

void DeterministicBench::exchange_load_cell() {
  if (abandoned_) return;
  if (connection_) {
    ask_box();
    std::array<std::uint8_t, 8> request{};
    while (connection_->next_request(request)) sim_->wire().request(request, kHost, clock_.now());
  }
  sim::Datagram datagram;
  while (sim_->wire().next_datagram(datagram, clock_.now())) {
    if (!connection_ || datagram.foreign) continue;  // a connected socket does not see what others send
    const std::uint64_t drained = connection_->counters().drained;
    connection_->receive(datagram.payload(), datagram.at);
    if (witness_.heard) witness_.heard(datagram, connection_->counters().drained > drained);
  }
  if (connection_) connection_->deliver();
}

/// Delivers the answer to the last question once it is due, then asks the next one.
void DeterministicBench::ask_box() {
  if (answer_ && clock_.now() >= answer_due_)
    connection_->answered(*std::exchange(answer_, std::nullopt), clock_.now());
  if (answer_ || !connection_->next_question()) return;
  Duration wait{0};
  answer_ = netbox::ask_box([&] {
    const std::string operation = "GET /netftapi2.xml";
    if (sim_->wire().http_refused(clock_.now())) throw DeviceError("Net Box", operation, "connection refused");
    const sim::StreamReply reply = sim_->wire().http(operation + " HTTP/1.0\r\n\r\n", clock_.now());
    wait = std::min<Duration>(reply.wait, netbox::kAnswerTimeout);
    if (wait < reply.wait) throw DeviceError("Net Box", operation, "no answer in time");
    return body_of(reply.bytes, operation);
  });
  answer_due_ = clock_.now() + wait;
}

void DeterministicBench::abandon() noexcept {
  abandoned_ = true;
  motor_->abandon();
  if (supply_) supply_->abandon();
}

void DeterministicBench::sleep(Duration lasts, const std::function<void()>& each) {
  for (const Instant wakes = clock_.now() + lasts; clock_.now() < wakes;) {
    outlive(std::min(wakes, clock_.now() + std::chrono::milliseconds(1)));
    if (each) each();
  }
  clock_.suspend(lasts);
}

void DeterministicBench::outlive(Instant when) {
  clock_.set(when);
  sim_->advance(when);
}

std::shared_ptr<void> DeterministicBench::run_periodically(const ThreadRole&, std::function<void()> work) {
  const auto entry = work_.insert(work_.end(), std::move(work));
  return {nullptr, [this, entry](void*) { work_.erase(entry); }};
}

void DeterministicBench::restore_power(const StopAsked& stop_asked) {
  power_->restore(*motor_, clock_, stop_asked, [this] { wait_until(clock_.now() + kSupplyRises); });
}

void DeterministicBench::mounted(const std::string& propeller_id, double occlusion_deg) {
  try {
    sim_->mount(propeller_id, occlusion_deg);
    mounted_ = {propeller_id, occlusion_deg};
  } catch (const std::invalid_argument& e) {
    throw DeviceError("simulated bench", "mount", e.what());
  }
}

void DeterministicBench::hung(int axis, double newtons) { sim_->hang(axis, newtons); }

results::LoadCellScale DeterministicBench::start() {
  connection_.reset();
  answer_.reset();
  read_box();
  connection_.emplace(configuration_);
  if (witness_.stream_began) witness_.stream_began();
  connection_->start(clock_.now());
  const Instant give_up = clock_.now() + kHandshake;
  while (connection_->state() != netbox::State::streaming && clock_.now() < give_up) {
    step_to(clock_.now() + std::chrono::milliseconds(1));
  }
  if (connection_->state() != netbox::State::streaming)
    throw DeviceError("Net Box", "start the stream", "no record arrived");
  results::LoadCellScale scale = to_scale(configuration_);
  scale.slots_json = slots_json_;
  return scale;
}

void DeterministicBench::stop() noexcept {
  connection_->stop(clock_.now());
  exchange_load_cell();
}

void DeterministicBench::set_bias() noexcept {
  connection_->set_bias(clock_.now());
  exchange_load_cell();
}

std::string DeterministicBench::failure() const {
  if (connection_ && connection_->state() == netbox::State::silent) return "load cell: the stream fell silent";
  return "";
}

}  // namespace kphi::daq
