#include "daq/live_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "daq/awake.hpp"
#include "daq/interrupt.hpp"
#include "daq/motor_audit.hpp"
#include "daq/sleep_inhibitor.hpp"
#include "daq/slot_pages.hpp"
#include "drivers/device_error.hpp"
#include "drivers/netbox/calinfo.hpp"
#include "drivers/netbox/http.hpp"
#include "drivers/sim/control_line.hpp"

namespace kphi::daq {
namespace {

constexpr Duration kDrainWall = std::chrono::milliseconds(5);
constexpr std::chrono::seconds kCalinfoTimeout{1};
constexpr std::chrono::seconds kPageTimeout{5};
constexpr std::chrono::seconds kWakes{5};  // of the module, after its power came back
constexpr Duration kSyncWall = std::chrono::milliseconds(500);

iq::Settings motor_settings(const profiles::MotorPlace& place) {
  iq::Settings settings;
  settings.module_id = place.module_id;
  settings.telemetry_hz = place.telemetry_hz;
  return settings;
}

netbox::Place rdt_place(const profiles::NetBoxPlace& place) { return {place.host, place.rdt_port, place.http_port}; }

netbox::WantedSettings wanted_settings(const profiles::NetBoxPlace& place) {
  netbox::WantedSettings wanted;
  if (place.settings.rate_hz) wanted.rate_hz = static_cast<int>(std::lround(*place.settings.rate_hz));
  wanted.records_per_datagram = place.settings.records_per_datagram;
  wanted.configuration = place.settings.configuration;
  if (!place.settings.filter_hz) return wanted;
  for (int code = 0; const auto cutoff_hz = netbox::filter_cutoff_hz(code); ++code) {
    if (*cutoff_hz == *place.settings.filter_hz) wanted.filter = code;
  }
  return wanted;
}

/// Where the next program finds what a killed one has left changed in this box.
std::filesystem::path settings_journal(const profiles::NetBoxPlace& place) {
  const auto variable = [](const char* name) { return std::string(std::getenv(name) ? std::getenv(name) : ""); };
  std::filesystem::path folder = variable("XDG_STATE_HOME");
  if (folder.empty()) {
    folder = variable("HOME").empty() ? std::filesystem::temp_directory_path()
                                      : std::filesystem::path(variable("HOME")) / ".local" / "state";
  }
  std::string name = fmt::format("netbox_{}_{}.journal", place.host, place.http_port);
  std::replace(name.begin(), name.end(), '/', '_');
  return folder / "kphi" / name;
}

std::string page_of(const profiles::NetBoxPlace& place, const std::string& target) {
  return netbox::http_get(place.host, place.http_port, target, kPageTimeout);
}

void require_no_stop(const std::function<bool()>& stop_asked) {
  if (stop_asked()) throw Interrupted("stopped by request, before anything was switched on");
}

class Thread final : public Background {
 public:
  explicit Thread(std::function<void()> work)
      : thread_([this, work = std::move(work)] {
          while (!stop_) {
            work();
            std::this_thread::sleep_for(kDrainWall);
          }
        }) {}
  ~Thread() override {
    stop_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace

LiveMotor::LiveMotor(const profiles::MotorPlace& place, const Clock& clock)
    : place_(place), clock_(clock), motor_(connect()), identity_(motor_->identity().summary()) {
  parameters_ = read_parameters(motor_->identity(), [this](auto asked) { return motor_->inquire(std::move(asked)); });
}

std::shared_ptr<iq::Motor> LiveMotor::connect() const {
  auto motor = std::make_shared<iq::Motor>(place_.device, place_.baud, motor_settings(place_), clock_, place_.capture);
  (void)motor->take_events();  // that it is connected
  return motor;
}

std::shared_ptr<iq::Motor> LiveMotor::connected() const {
  if (auto motor = this->motor()) return motor;
  throw DeviceError("motor module on " + place_.device, "spin", "it has no power");
}

void LiveMotor::rest() { std::atomic_store(&motor_, std::shared_ptr<iq::Motor>()); }

void LiveMotor::wake() {
  rest();
  const auto give_up = std::chrono::steady_clock::now() + kWakes;
  for (std::shared_ptr<iq::Motor> found; !found;) {
    try {
      found = connect();
    } catch (const DeviceError&) {
      if (std::chrono::steady_clock::now() > give_up) throw;
      std::this_thread::sleep_for(kDrainWall);  // it may still be starting
      continue;
    }
    if (const std::string now = found->identity().summary(); now != identity_)
      throw DeviceError("motor module on " + place_.device, "connect again",
                        fmt::format("another module answers: {} instead of {}", now, identity_));
    std::atomic_store(&motor_, std::move(found));
    return;
  }
}

void LiveMotor::spin_at(RadPerSec signed_speed) { connected()->spin_at(signed_speed); }

void LiveMotor::renew() noexcept {
  if (const auto motor = this->motor()) motor->renew();
}

void LiveMotor::emergency_stop() noexcept {
  if (const auto motor = this->motor()) motor->emergency_stop();
}

void LiveMotor::begin_stop(const iq::StopSettings& settings) {
  if (stop_.valid() && !stop_report()) return;
  stop_report_.reset();
  stop_ = std::async(std::launch::async,
                     [motor = motor(), settings] { return motor ? motor->stop(settings) : iq::StopReport{}; });
}

std::optional<iq::StopReport> LiveMotor::stop_report() {
  if (stop_.valid() && stop_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) stop_report_ = stop_.get();
  return stop_report_;
}

std::optional<Celsius> LiveMotor::coil_temperature() {
  return ask_coil_temperature(parameters_, [this](auto asked) { return connected()->inquire(std::move(asked)); });
}

std::vector<results::StreamEvent> LiveMotor::take_events() {
  std::vector<results::StreamEvent> events;
  const auto motor = this->motor();
  if (!motor) return events;
  for (const iq::Event& event : motor->take_events()) events.push_back(to_event(event));
  return events;
}

std::size_t LiveMotor::take(std::span<results::MotorReading> out) {
  const auto motor = this->motor();
  if (!motor) return 0;
  readings_.resize(out.size());
  const std::size_t n = motor->take(readings_);
  for (std::size_t i = 0; i < n; ++i) out[i] = to_reading(readings_[i]);
  return n;
}

std::string LiveMotor::failure() const {
  const auto motor = this->motor();
  if (!motor) return "";
  if (const std::string failure = motor->failure(); !failure.empty()) return "motor: " + failure;
  if (motor->counters().lease_expiries == 0) return "";
  return "motor: kphi did not renew its command in time, so the driver let it coast; close other programs";
}

LiveLoadCell::LiveLoadCell(profiles::NetBoxPlace place, const Clock& clock, const std::function<bool()>& stop_asked)
    : place_(std::move(place)),
      clock_(clock),
      settings_(rdt_place(place_), wanted_settings(place_), settings_journal(place_)),
      // Whether the box answers at all is asked before anybody mounts anything.
      cell_(std::make_unique<netbox::LoadCell>(rdt_place(place_), clock_)),
      findings_(settings_.notes()) {
  if (auto finding = netbox::cross_check(place_.host, place_.tcp_port, configuration(), kCalinfoTimeout)) {
    if (finding->severity == netbox::Severity::fault)
      throw DeviceError("Net Box " + place_.host, "compare its scale", finding->what, finding->next_move);
    findings_.push_back(std::move(*finding));
  }
  SlotPages slots = read_slot_pages([&](const std::string& target) {
    require_no_stop(stop_asked);
    return page_of(place_, target);
  });
  slots_json_ = std::move(slots.json);
  findings_.insert(findings_.end(), slots.findings.begin(), slots.findings.end());
}

results::LoadCellScale LiveLoadCell::start() {
  cell_.reset();
  cell_ = std::make_unique<netbox::LoadCell>(rdt_place(place_), clock_);
  const netbox::Configuration& found = cell_->configuration();
  if (std::abs(found.rdt_rate_hz - place_.rate_hz) > 0.5) {
    throw DeviceError(
        "Net Box " + place_.host, "compare settings",
        fmt::format("it streams at {:g} Hz, the bench file says {:g} Hz", found.rdt_rate_hz, place_.rate_hz),
        "set the RDT output rate on the box's communication page or rate_hz in the bench file");
  }
  cell_->start();
  results::LoadCellScale scale = to_scale(found);
  scale.slots_json = slots_json_;
  return scale;
}

std::vector<results::StreamEvent> LiveLoadCell::take_events() {
  std::vector<results::StreamEvent> events;
  for (const netbox::Event& event : cell_->take_events()) events.push_back(to_event(event));
  return events;
}

std::string LiveLoadCell::page() { return page_of(place_, "/netftapi2.xml"); }

void LiveLoadCell::stop() noexcept { cell_->stop(); }

std::size_t LiveLoadCell::take(std::span<results::LoadCellRecord> out) {
  records_.resize(out.size());
  const std::size_t n = cell_->take(records_);
  for (std::size_t i = 0; i < n; ++i) out[i] = to_record(records_[i]);
  return n;
}

std::string LiveLoadCell::failure() const {
  switch (cell_->state()) {
    case netbox::State::silent:
      return "load cell: the stream fell silent";
    case netbox::State::failed:
      return "load cell: the stream could not be started again";
    default:
      return "";
  }
}

results::SampleAccount LiveLoadCell::account() const { return to_account(cell_->counters()); }

LiveBench::LiveBench(const profiles::Bench& place, const std::function<bool()>& stop_asked)
    : place_(place),
      clock_(place.simulation ? place.simulation->time_scale : 1.0),
      air_(place.ambient, clock_),
      load_cell_(place.netbox, clock_, stop_asked),
      supply_(place.supply ? std::make_unique<LiveSupply>(*place.supply, clock_) : nullptr),
      powered_(power(stop_asked)),
      motor_(place.iq, clock_) {}

std::unique_ptr<Powered> LiveBench::power(const std::function<bool()>& stop_asked) {
  require_no_stop(stop_asked);
  require_awake(clock_);
  return supply_ ? std::make_unique<Powered>(*supply_) : nullptr;
}

bool LiveBench::unpower() {
  if (!supply_) return false;
  motor_.rest();
  if (const std::string why = supply_->switch_off(); !why.empty())
    throw SafetyStop(why, "cut the power of the motor at the switch before you go near");
  powered_.reset();
  return true;
}

void LiveBench::repower() {
  require_awake(clock_);
  if (supply_) {
    powered_ = std::make_unique<Powered>(*supply_);
    motor_.wake();
  } else if (!motor_.failure().empty()) {
    motor_.wake();
  }
}

std::shared_ptr<void> LiveBench::keep_awake(std::string& why_not) {
  auto inhibitor = std::make_shared<SleepInhibitor>();
  why_not = inhibitor->why_not();
  return inhibitor;
}

void LiveBench::wait_until(Instant when) {
  const Duration left = clock_.shrunk(when - clock_.now());
  if (left > Duration(0)) std::this_thread::sleep_for(left);
}

std::unique_ptr<Background> LiveBench::keep_calling(std::function<void()> work) {
  return std::make_unique<Thread>(std::move(work));
}

Duration LiveBench::sync_interval() const { return clock_.stretched(kSyncWall); }

void LiveBench::mounted(const std::string& propeller_id, double occlusion_deg) {
  if (!place_.simulation || place_.simulation->control.empty()) return;
  const std::string answer =
      sim::tell(place_.simulation->control, fmt::format("mount {} {:g}", propeller_id, occlusion_deg));
  if (!answer.starts_with("ok")) throw DeviceError("simulated bench", "mount", answer);
}

}  // namespace kphi::daq
