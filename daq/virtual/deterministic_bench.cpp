#include "daq/virtual/deterministic_bench.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "base/error.hpp"
#include "daq/bench/device_records.hpp"
#include "daq/bench/slot_pages.hpp"
#include "daq/guard/interlock.hpp"
#include "drivers/netbox/configuration/calinfo.hpp"
#include "drivers/sim/input_files.hpp"
#include "profiles/strict_yaml.hpp"

namespace kphi::daq {
namespace {

constexpr Duration kHandshake = std::chrono::seconds(5);
constexpr Duration kSupplyRises = std::chrono::milliseconds(500);
constexpr Duration kWorkEvery = std::chrono::milliseconds(5);
constexpr Duration kSyncEvery = std::chrono::seconds(1);
constexpr Duration kHttpTimeout = std::chrono::seconds(5);
constexpr Duration kMotorWait = std::chrono::milliseconds(1);
constexpr sim::Peer kHost = 1;

void load_motor(const std::string& path, sim::BenchSettings& settings) {
  if (path.empty()) return;
  const sim::MotorProfile profile = sim::parse_motor_profile(profiles::read_text(path), path);
  settings.plant.motor = profile.motor;
  settings.module.sensors = profile.sensors;
}

sim::BenchSettings settings_of(const profiles::BenchConfig& config, sim::BenchSettings settings) {
  settings.seed = config.simulation ? config.simulation->seed : 1;
  settings.netbox.rate_hz = config.netbox.rate_hz;
  settings.netbox.records_per_datagram = config.netbox.records_per_datagram;
  settings.module_id = config.iq.module_id;
  if (config.supply) settings.supply.emplace();
  if (config.simulation) settings.plant.air_density_kg_m3 = config.simulation->air_density_kg_m3;
  settings.module.baud = config.iq.baud;
  if (config.simulation) {
    if (const std::string& faults = config.simulation->faults; !faults.empty())
      sim::load_faults(profiles::read_text(faults), faults, settings);
    load_motor(config.simulation->motor, settings);
  }
  return settings;
}

netbox::StreamSettings stream_settings(const netbox::Configuration& box) {
  netbox::StreamSettings settings;
  settings.product = box.kind;
  settings.buffered = box.records_per_datagram > 1;
  settings.divisor = box.divisor;
  settings.records_per_datagram = box.records_per_datagram;
  settings.reply_timeout = std::chrono::milliseconds(100);
  return settings;
}

/// Throws DeviceError, as the true transport would.
std::string body_of(const std::string& response, const std::string& operation) {
  const std::size_t blank = response.find("\r\n\r\n");
  const std::string status = response.substr(0, response.find("\r\n"));
  if (blank == std::string::npos) throw DeviceError("Net Box", operation, "the answer is cut short");
  if (status.find(" 200 ") == std::string::npos) throw DeviceError("Net Box", operation, "the box says: " + status);
  return response.substr(blank + 4);
}

class WithinWaits final : public Background {
 public:
  WithinWaits(std::function<void()> work, std::vector<std::function<void()>*>& all)
      : work_(std::move(work)), all_(all) {
    all_.push_back(&work_);
  }
  ~WithinWaits() override { std::erase(all_, &work_); }

 private:
  std::function<void()> work_;
  std::vector<std::function<void()>*>& all_;
};

}  // namespace

DeterministicBench::DeterministicBench(const profiles::BenchConfig& config, const sim::BenchSettings& other)
    : clock_(other.begin),
      air_({.sensor = "", .manual = config.ambient.manual}, clock_),
      sim_(settings_of(config, other)),
      supply_(config.supply ? std::make_unique<DeterministicSupply>(*config.supply, *sim_.supply(), clock_) : nullptr),
      powered_(supply_ ? std::make_unique<OutputEnable>(*supply_) : nullptr),
      motor_(config.iq, sim_.motor_line(), clock_, [this] { step_to(clock_.now() + kMotorWait); }) {
  if (config.simulation && config.simulation->durable) files_ = &results::disk();
  if (supply_) {
    clock_.set(clock_.now() + kSupplyRises);
    sim_.advance(clock_.now());
  }
  if (!config.ambient.sensor.empty()) {
    const sim::BenchSettings settings = settings_of(config, other);
    measured_air_.emplace(clock_, settings.air, settings.air_faults);
  }
  motor_.connect();
  read_box();
  cross_check();
  SlotPages slots = read_slot_pages([this](const std::string& target) { return page(target); });
  slots_json_ = std::move(slots.json);
  findings_.insert(findings_.end(), slots.findings.begin(), slots.findings.end());
}

std::string DeterministicBench::page(const std::string& target) {
  const std::string operation = "GET " + target;
  if (sim_.wire().http_refused(clock_.now())) throw DeviceError("Net Box", operation, "connection refused");
  const sim::StreamReply reply = sim_.wire().http(operation + " HTTP/1.0\r\n\r\n", clock_.now());
  if (reply.wait > kHttpTimeout) throw DeviceError("Net Box", operation, "no answer in time");
  wait_until(clock_.now() + reply.wait);
  return body_of(reply.bytes, operation);
}

void DeterministicBench::read_box() { configuration_ = netbox::parse_configuration(page()); }

void DeterministicBench::cross_check() {
  const auto request = netbox::encode_read_calinfo();
  std::string received(request.begin(), request.end());
  const std::string answer = sim_.wire().tcp(received, clock_.now()).bytes;
  const auto calinfo = netbox::decode_calinfo({reinterpret_cast<const std::uint8_t*>(answer.data()), answer.size()});
  if (!calinfo) throw DeviceError("Net Box", "read the calibration over TCP", "the answer is none of a Net Box");
  if (const auto finding = netbox::compare(*calinfo, configuration_))
    throw DeviceError("Net Box", "compare its scale", finding->what, finding->next_move);
}

void DeterministicBench::wait_until(Instant when) {
  const Duration datagram = from_seconds(40.0 / 7000.0);
  while (clock_.now() < when) {
    Instant next = std::min(when, clock_.now() + datagram);
    next = std::min(next, motor_.deadline());
    if (stream_) next = std::min({next, stream_->deadline(), stream_->release_deadline(), sim_.wire().next_arrival()});
    step_to(std::max(next, clock_.now() + Duration(1)));
    if (clock_.now() >= next_work_) {
      for (const auto* work : work_) (*work)();
      next_work_ = clock_.now() + kWorkEvery;
    }
  }
}

void DeterministicBench::step_to(Instant when) {
  clock_.set(when);
  sim_.advance(when);
  if (supply_) supply_->look();
  if (measured_air_) measured_air_->look();
  exchange();  // what came is received before anything is found to be late
  motor_.advance(when);
  if (stream_) {
    stream_->release(when, records_);
    stream_->advance(when);
  }
  exchange();
  if (witness_.stepped) witness_.stepped();
}

void DeterministicBench::exchange() {
  motor_.exchange();
  exchange_load_cell();
}

void DeterministicBench::exchange_load_cell() {
  if (abandoned_) return;
  if (stream_) {
    std::array<std::uint8_t, 8> request{};
    while (stream_->next_request(request)) sim_.wire().request(request, kHost, clock_.now());
  }
  sim::Datagram datagram;
  while (sim_.wire().next_datagram(datagram, clock_.now())) {
    if (!stream_ || datagram.foreign) continue;  // a connected socket does not see what others send
    const std::size_t before = records_.size();
    const std::uint64_t drained = stream_->counters().drained;
    stream_->receive(datagram.payload(), datagram.at, records_);
    if (witness_.heard) witness_.heard(datagram, stream_->counters().drained > drained);
    if (records_.size() > before) meter_->note(records_.back(), records_.size() - before, stream_->counters().reboots);
  }
}

void DeterministicBench::abandon() noexcept {
  abandoned_ = true;
  motor_.abandon();
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
  sim_.advance(when);
}

std::unique_ptr<Background> DeterministicBench::run_periodically(std::function<void()> work) {
  return std::make_unique<WithinWaits>(std::move(work), work_);
}

Duration DeterministicBench::sync_interval() const { return kSyncEvery; }

bool DeterministicBench::switch_off_power() {
  if (!supply_) return false;
  motor_.rest();
  if (const std::string why = supply_->switch_off(); !why.empty())
    throw SafetyStop(why, "cut the power of the motor at the switch before you go near");
  powered_.reset();
  return true;
}

void DeterministicBench::restore_power() {
  if (supply_) {
    powered_ = std::make_unique<OutputEnable>(*supply_);
    wait_until(clock_.now() + kSupplyRises);
    motor_.wake();
  } else if (!motor_.failure().empty()) {
    motor_.wake();
  }
}

void DeterministicBench::mounted(const std::string& propeller_id, double occlusion_deg) {
  try {
    sim_.mount(propeller_id, occlusion_deg);
  } catch (const std::invalid_argument& e) {
    throw DeviceError("simulated bench", "mount", e.what());
  }
}

results::LoadCellScale DeterministicBench::start() {
  stream_.reset();
  read_box();
  stream_.emplace(stream_settings(configuration_));
  if (witness_.stream_began) witness_.stream_began();
  meter_.emplace(configuration_.device_rate_hz);
  meter_->begin();
  records_.clear();
  taken_ = 0;
  stream_->start(clock_.now());
  const Instant give_up = clock_.now() + kHandshake;
  while (stream_->state() != netbox::State::streaming && clock_.now() < give_up) {
    step_to(clock_.now() + std::chrono::milliseconds(1));
  }
  if (stream_->state() != netbox::State::streaming) throw DeviceError("Net Box", "start the stream", "no record came");
  results::LoadCellScale scale = to_scale(configuration_);
  scale.slots_json = slots_json_;
  return scale;
}

void DeterministicBench::stop() noexcept {
  stream_->flush(records_);
  stream_->stop(clock_.now());
  exchange_load_cell();
}

std::size_t DeterministicBench::take(std::span<results::LoadCellRecord> out) {
  const std::size_t n = std::min(out.size(), records_.size() - taken_);
  for (std::size_t i = 0; i < n; ++i) out[i] = to_record(records_[taken_ + i]);
  taken_ += n;
  if (taken_ == records_.size()) {
    records_.clear();
    taken_ = 0;
  }
  return n;
}

std::vector<results::StreamEvent> DeterministicBench::take_events() {
  std::vector<results::StreamEvent> events;
  for (netbox::Event event : stream_->take_events()) {
    events.push_back(to_event(event));
    if (event.kind != netbox::EventKind::silent) continue;
    event = {};
    event.kind = why_silent();
    event.at = clock_.now();
    events.push_back(to_event(event));
  }
  events_dropped_ = stream_->events().dropped();
  return events;
}

/// What netbox::Inquiry asks over HTTP.
netbox::EventKind DeterministicBench::why_silent() {
  if (sim_.wire().http_refused(clock_.now())) return netbox::EventKind::unreachable;
  try {
    const std::string operation = "GET /netftapi2.xml";
    const std::string xml = body_of(sim_.wire().http(operation + " HTTP/1.0\r\n\r\n", clock_.now()).bytes, operation);
    return netbox::parse_configuration(xml).rdt_enabled ? netbox::EventKind::taken_over
                                                        : netbox::EventKind::rdt_disabled;
  } catch (const DeviceError&) {
    return netbox::EventKind::unreachable;
  }
}

void DeterministicBench::set_bias() noexcept {
  stream_->set_bias(clock_.now());
  exchange_load_cell();
}

results::StreamHealth DeterministicBench::health() const {
  netbox::Health health = meter_->health();
  health.events_dropped = events_dropped_;
  return to_health(health, clock_);
}

results::SampleAccount DeterministicBench::account() const { return to_account(stream_->counters()); }

std::string DeterministicBench::failure() const {
  if (stream_ && stream_->state() == netbox::State::silent) return "load cell: the stream fell silent";
  return "";
}

}  // namespace kphi::daq
