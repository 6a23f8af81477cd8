#include "daq/hardware/live_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "base/error.hpp"
#include "base/real_time.hpp"
#include "base/thread.hpp"
#include "daq/audit/bench_audit.hpp"
#include "daq/bench/box.hpp"
#include "daq/bench/offered_drivers.hpp"
#include "daq/guard/run_stopped.hpp"
#include "daq/hardware/device_locks.hpp"
#include "daq/hardware/realtime_kit.hpp"
#include "daq/hardware/sleep_inhibitor.hpp"
#include "drivers/netbox/configuration/calinfo.hpp"
#include "drivers/netbox/configuration/http.hpp"
#include "drivers/netbox/wire/rdt.hpp"
#include "drivers/sim/control_line.hpp"

namespace kphi::daq {
namespace {

constexpr Duration kDrainWall = std::chrono::milliseconds(5);
constexpr std::chrono::seconds kCalinfoTimeout{1};
constexpr std::chrono::seconds kPageTimeout{5};
constexpr std::chrono::seconds kBootTime{5};  // of the module, after its power came back
constexpr const char* kBeforePower = "before anything was switched on";
constexpr const char* kWhileConnecting = "before anything turned";
constexpr Duration kSyncWall = std::chrono::milliseconds(500);

iq::Settings motor_settings(const profiles::MotorConfig& config) {
  iq::Settings settings;
  settings.module_id = config.module_id;
  settings.telemetry_hz = config.telemetry_hz;
  return settings;
}

netbox::Address rdt_address(const profiles::NetBoxConfig& config) {
  return {config.host, config.rdt_port, config.http_port, config.bind};
}

netbox::WantedSettings wanted_settings(const profiles::NetBoxConfig& config) {
  netbox::WantedSettings wanted;
  if (config.settings.rate_hz) wanted.rate_hz = static_cast<int>(std::lround(*config.settings.rate_hz));
  wanted.records_per_datagram = config.settings.records_per_datagram;
  wanted.configuration = config.settings.configuration;
  if (!config.settings.filter_hz) return wanted;
  for (int code = 0; const auto cutoff_hz = netbox::filter_cutoff_hz(code); ++code) {
    if (*cutoff_hz == *config.settings.filter_hz) wanted.filter = code;
  }
  return wanted;
}

/// The journal of settings that a killed program left changed in this box; the next program restores them.
std::filesystem::path settings_journal(const profiles::NetBoxConfig& config) {
  const auto variable = [](const char* name) { return std::string(std::getenv(name) ? std::getenv(name) : ""); };
  std::filesystem::path folder = variable("XDG_STATE_HOME");
  if (folder.empty()) {
    folder = variable("HOME").empty() ? std::filesystem::temp_directory_path()
                                      : std::filesystem::path(variable("HOME")) / ".local" / "state";
  }
  std::string name = fmt::format("netbox_{}_{}.journal", config.host, config.http_port);
  std::replace(name.begin(), name.end(), '/', '_');
  return folder / "kphi" / name;
}

std::string page_of(const profiles::NetBoxConfig& config, const std::string& target) {
  return netbox::http_get({config.host, config.bind}, config.http_port, target, kPageTimeout);
}

/// The box first: it is quick.
std::vector<LastWord> last_words(const profiles::BenchConfig& config, const LiveSupply* supply) {
  const auto stop = netbox::encode_request(netbox::Command::stop);
  const profiles::NetBoxConfig& box = config.netbox;
  const std::vector<std::string> names = lock_names(config);  // box, motor, supply
  std::vector<LastWord> words;
  if (!config.load_cell) {
    words.push_back({"stream of the Net Box " + box.host, LastWord::Wire::udp, box.host, box.rdt_port,
                     std::string(stop.begin(), stop.end())});
    words.back().from = box.bind;
    words.back().lock = lock_file(names.front());
  }
  if (supply == nullptr || !supply->off()) return words;
  words.push_back(*supply->off());
  words.back().lock = lock_file(names.back());
  return words;
}

/// Throws DeviceError for a supply whose output only this program could switch off again.
std::vector<LastWord> last_words_of_supply(const profiles::BenchConfig& config, const LiveSupply& supply) {
  if (supply.off()) return last_words(config, &supply);
  throw DeviceError(supply.identity(), "switch on", "if kphi died, nobody would switch it off",
                    "switch it on by hand, and off again");
}

/// Before the first thread of a device starts.
SteadyClock make_prompt(SteadyClock clock) {
  real_time::ask_through(&ask_realtime_kit);
  if (!kInstrumented) (void)real_time::lock_memory();
  return clock;
}

class PeriodicThread {
 public:
  PeriodicThread(const ThreadRole& role, std::function<void()> work)
      : work_(std::move(work)), thread_(start_thread(role, [this] { run(); })) {}
  ~PeriodicThread() {
    quit_ = true;
    thread_.join();
  }

 private:
  void run() {
    for (; !quit_; std::this_thread::sleep_for(kDrainWall)) work_();
  }
  std::function<void()> work_;
  std::atomic<bool> quit_{false};
  std::thread thread_;  ///< last: it uses the members above
};

}  // namespace

LiveMotor::LiveMotor(const profiles::MotorConfig& config, const Clock& clock, const StopAsked& stop_asked)
    : config_(config), clock_(clock), owned_(connect(stop_asked)), identity_(owned_->identity().summary()) {
  const bool newer = owned_->identity().value<"coil_temperature_estimator.t_coil">().has_value();
  const auto ask = [&](auto asked) {
    require_no_stop(stop_asked, kWhileConnecting);
    return owned_->inquire(std::move(asked));
  };
  parameters_ = iq::read_audit(ask, newer);
  motor_ = owned_.get();
}

std::unique_ptr<iq::Motor> LiveMotor::connect(const StopAsked& stop_asked) const {
  try {
    auto motor = std::make_unique<iq::Motor>(config_.device, config_.baud, motor_settings(config_), clock_,
                                             config_.capture, stop_asked);
    (void)motor->take_events();  // that it is connected
    return motor;
  } catch (const DeviceError&) {
    require_no_stop(stop_asked, kWhileConnecting);
    throw;
  }
}

iq::Motor& LiveMotor::connected() const {
  if (iq::Motor* motor = motor_) return *motor;
  throw DeviceError("motor module on " + config_.device, "spin", "the module has no power");
}

void LiveMotor::rest() {
  motor_ = nullptr;
  stop_.reset();
  if (!owned_) return;
  owned_->close();
  closed_ = std::move(owned_);
}

void LiveMotor::wake(const StopAsked& stop_asked) {
  rest();
  const auto give_up = std::chrono::steady_clock::now() + kBootTime;
  while (!owned_) {
    try {
      owned_ = connect(stop_asked);
    } catch (const DeviceError&) {
      if (std::chrono::steady_clock::now() > give_up) throw;
      std::this_thread::sleep_for(kDrainWall);  // it may still be booting
      continue;
    }
    if (const std::string now = owned_->identity().summary(); now != identity_) {
      owned_.reset();
      throw DeviceError("motor module on " + config_.device, "connect again",
                        fmt::format("a different module answers: {} instead of {}", now, identity_));
    }
  }
  motor_ = owned_.get();
}

void LiveMotor::renew() noexcept {
  if (iq::Motor* motor = motor_) motor->renew();
}

void LiveMotor::emergency_stop() noexcept {
  if (iq::Motor* motor = motor_) motor->emergency_stop();
}

void LiveMotor::begin_stop(const iq::StopSettings& settings) {
  if (stop_ && !stop_report()) return;
  stop_report_.reset();
  stop_.reset();
  if (iq::Motor* motor = motor_)
    stop_ = motor->begin_stop(settings);
  else
    stop_report_ = iq::StopReport{};
}

std::optional<iq::StopReport> LiveMotor::stop_report() {
  iq::Motor* const motor = motor_;
  if (stop_ && motor != nullptr) {
    motor->renew();  // whoever asks is alive
    stop_report_ = motor->stop_report(*stop_);
    if (stop_report_) stop_.reset();
  }
  return stop_report_;
}

std::optional<Celsius> LiveMotor::coil_temperature() {
  return ask_coil_temperature(parameters_, [this](auto asked) { return connected().inquire(std::move(asked)); });
}

results::MotorCounts LiveMotor::counts() const {
  const iq::Motor* const motor = motor_;
  return motor != nullptr ? to_counts(motor->counters()) : results::MotorCounts{};
}

std::vector<StreamEvent> LiveMotor::take_events() {
  iq::Motor* const motor = motor_;
  return motor != nullptr ? to_events(motor->take_events()) : std::vector<StreamEvent>();
}

std::size_t LiveMotor::take(std::span<MotorReading> out) {
  iq::Motor* const motor = motor_;
  return motor != nullptr ? motor->take(out) : 0;
}

std::string LiveMotor::failure() const {
  const iq::Motor* const motor = motor_;
  if (motor == nullptr) return "";
  if (const std::string failure = motor->failure(); !failure.empty()) return "motor: " + failure;
  if (!motor->lease_has_expired()) return "";
  return "motor: kphi did not renew its command in time, so the driver coasted it; close other programs";
}

LiveLoadCell::LiveLoadCell(profiles::NetBoxConfig config, const Clock& clock, const std::function<bool()>& stop_asked)
    : config_(std::move(config)),
      clock_(clock),
      settings_(rdt_address(config_), wanted_settings(config_), settings_journal(config_)),
      // Checks that the box answers before anybody mounts anything.
      cell_(std::make_unique<netbox::LoadCell>(rdt_address(config_), clock_)),
      findings_(settings_.notes()) {
  if (auto finding = netbox::cross_check({config_.host, config_.bind}, config_.tcp_port, cell_->configuration(),
                                         kCalinfoTimeout)) {
    if (finding->severity == Severity::fault)
      throw DeviceError("Net Box " + config_.host, "compare its scale", finding->what, finding->next_move);
    findings_.push_back(std::move(*finding));
  }
  require_no_stop(stop_asked, kBeforePower);
  CalibrationPage page = read_calibration_page([&](const std::string& target) { return page_of(config_, target); },
                                               cell_->configuration().calibration);
  slots_json_ = std::move(page.json);
  findings_.insert(findings_.end(), page.findings.begin(), page.findings.end());
}

results::LoadCellScale LiveLoadCell::start() {
  cell_.reset();
  cell_ = std::make_unique<netbox::LoadCell>(rdt_address(config_), clock_);
  const netbox::Configuration& found = cell_->configuration();
  if (std::abs(found.rdt_rate_hz - config_.rate_hz) > 0.5) {
    throw DeviceError(
        "Net Box " + config_.host, "compare settings",
        fmt::format("the box streams at {:g} Hz, the bench file expects {:g} Hz", found.rdt_rate_hz, config_.rate_hz),
        "set the RDT output rate on the box's Communications page, or rate_hz in the bench file");
  }
  cell_->start();
  results::LoadCellScale scale = to_scale(found);
  scale.slots_json = slots_json_;
  return scale;
}

std::string LiveLoadCell::page() { return page_of(config_, "/netftapi2.xml"); }

std::string LiveLoadCell::failure() const {
  const netbox::State state = cell_->state();
  if (state == netbox::State::silent) return "load cell: the stream fell silent";
  return state == netbox::State::failed ? "load cell: the stream could not be started again" : "";
}

ModulePower::ModulePower(const profiles::BenchConfig& config, const Clock& clock, const StopAsked& stop_asked)
    : supply_(*config.supply, clock), sentinel_(last_words_of_supply(config, supply_)), on_(&supply_, stop_asked) {}

LiveBench::LiveBench(const profiles::BenchConfig& config, const std::function<bool()>& stop_asked)
    : config_(config),
      clock_(make_prompt(SteadyClock(config.simulation ? config.simulation->time_scale : 1.0))),
      air_(config.ambient, clock_),
      load_cell_(config.load_cell ? connect_load_cell(config, clock_)
                                  : std::make_unique<LiveLoadCell>(config.netbox, clock_, stop_asked)),
      supply_(config.supply ? std::make_unique<LiveSupply>(*config.supply, clock_) : nullptr),
      sentinel_(last_words(config, supply_.get())),
      power_(supply_to_switch_on(stop_asked), stop_asked),
      motor_(connect_motor_with_power(stop_asked)) {}

std::unique_ptr<MotorLink> LiveBench::connect_motor_with_power(const StopAsked& stop_asked) {
  try {
    std::unique_ptr<MotorLink> motor;
    if (config_.motor)
      motor = connect_motor(config_, clock_);
    else
      motor = std::make_unique<LiveMotor>(config_.iq, clock_, stop_asked);
    require_no_stop(stop_asked, kWhileConnecting);
    return motor;
  } catch (...) {
    rethrow_without_power(supply_.get());
  }
}

SupplyLink* LiveBench::supply_to_switch_on(const std::function<bool()>& stop_asked) {
  require_no_stop(stop_asked, kBeforePower);
  require_awake(clock_);
  return supply_.get();
}

std::shared_ptr<void> LiveBench::keep_awake(std::string& why_not) {
  auto inhibitor = std::make_shared<SleepInhibitor>();
  why_not = inhibitor->why_not();
  return inhibitor;
}

std::shared_ptr<void> LiveBench::keep_prompt(std::string& why_not) {
  auto scope = std::make_shared<real_time::Scope>();
  why_not = priority_words(real_time::refusal());
  return scope;
}

void LiveBench::wait_until(Instant when) {
  const Duration left = clock_.shrunk(when - clock_.now());
  if (left > Duration(0)) std::this_thread::sleep_for(left);
}

std::shared_ptr<void> LiveBench::run_periodically(const ThreadRole& role, std::function<void()> work) {
  return std::make_shared<PeriodicThread>(role, std::move(work));
}

void LiveBench::restore_power(const StopAsked& stop_asked) {
  if (const std::string why = unprotected(); !why.empty()) throw SafetyStop(why);
  power_.restore(*motor_, clock_, stop_asked);
}

std::vector<StreamEvent> LiveBench::take_news() {
  std::vector<StreamEvent> events;
  for (const std::string& line : sentinel_.take_news())
    events.push_back(event_at(clock_.now(), EventKind::sentinel_replaced, line));
  return events;
}

Duration LiveBench::sync_interval() const { return clock_.stretched(kSyncWall); }

void LiveBench::mounted(const std::string& propeller_id, double occlusion_deg) {
  tell_simulation(fmt::format("mount {} {:g}", propeller_id, occlusion_deg));
}

void LiveBench::hung(int axis, double newtons) { tell_simulation(fmt::format("hang {} {}", "xyz"[axis], newtons)); }

void LiveBench::tell_simulation(const std::string& line) {
  if (!config_.simulation || config_.simulation->control.empty()) return;
  const std::string answer = sim::tell(config_.simulation->control, line);
  if (!answer.starts_with("ok")) throw DeviceError("simulated bench", line.substr(0, line.find(' ')), answer);
}

}  // namespace kphi::daq
