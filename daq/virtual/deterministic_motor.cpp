#include "daq/virtual/deterministic_motor.hpp"

#include "base/error.hpp"
#include "daq/audit/bench_audit.hpp"

namespace kphi::daq {
namespace {

constexpr Duration kWakes = std::chrono::seconds(5);  // of the module, after its power came back

iq::Settings settings_of(const profiles::MotorConfig& config) {
  iq::Settings settings;
  settings.module_id = config.module_id;
  settings.telemetry_hz = config.telemetry_hz;
  settings.reply_timeout = std::chrono::milliseconds(100);
  settings.wire_byte_time = from_seconds(10.0 / config.baud);
  return settings;
}

}  // namespace

DeterministicMotor::DeterministicMotor(const profiles::MotorConfig& config, sim::IqLine& line, const Clock& clock,
                                       std::function<void()> step)
    : line_(line), clock_(clock), step_(std::move(step)), session_(settings_of(config)) {
  line_.host_rate(config.baud);
}

void DeterministicMotor::connect() {
  session_.connect(clock_.now());
  while (session_.state() == iq::Session::State::connecting) step_();
  if (session_.state() != iq::Session::State::ready) throw DeviceError("IQ module", "connect", session_.failure());
  const bool newer = session_.identity().value<"coil_temperature_estimator.t_coil">().has_value();
  parameters_ = iq::read_audit([this](const auto& asked) { return ask(asked); }, newer);
  (void)session_.take_events();  // that it is connected
}

void DeterministicMotor::wake(const StopAsked&) {
  resting_ = false;
  const Instant give_up = clock_.now() + kWakes;
  do {
    session_.connect_anew(clock_.now());
    while (session_.state() == iq::Session::State::connecting) step_();
  } while (session_.state() != iq::Session::State::ready && clock_.now() < give_up);
  if (session_.state() != iq::Session::State::ready)
    throw DeviceError("IQ module", "connect again", session_.failure());
  session_.rearm();
  failure_.clear();
  (void)session_.take_events();
}

std::vector<iq::Reply> DeterministicMotor::ask(const std::vector<iq::Inquiry>& asked) {
  if (session_.state() != iq::Session::State::ready) throw DeviceError("IQ module", "ask", failure());
  session_.inquire(asked, clock_.now());
  while (!session_.inquiries().done()) step_();
  return session_.inquiries().replies();
}

void DeterministicMotor::exchange() {
  if (abandoned_) return;
  const Instant now = clock_.now();
  if (resting_) return discard(now);
  watch_plug();
  for (bool heard = true; heard || (plugged_ && !session_.output().empty());) {
    if (plugged_ && !session_.output().empty()) {
      line_.send(session_.output(), now);
      session_.sent(session_.output().size());
    }
    line_.advance(now);
    heard = false;
    for (sim::IqChunk chunk; line_.next_chunk(chunk, now); heard = true) session_.receive(chunk.bytes, now);
  }
}

/// The port is closed: what comes is lost.
void DeterministicMotor::discard(Instant now) {
  line_.advance(now);
  for (sim::IqChunk chunk; line_.next_chunk(chunk, now);) {
  }
}

/// As iq::Link does with its port.
void DeterministicMotor::watch_plug() {
  if (plugged_ == line_.plugged()) return;
  plugged_ = line_.plugged();
  if (plugged_) return session_.connect_anew(clock_.now());
  session_.fail(EventKind::motor_port_lost, "the serial port is gone", clock_.now());
}

void DeterministicMotor::spin_at(RadPerSec signed_speed) {
  if (!session_.armed()) throw DeviceError("IQ module", "spin", failure(), "find the cause, then connect again");
  session_.spin_at(signed_speed, clock_.now());
  exchange();
}

void DeterministicMotor::emergency_stop() noexcept {
  if (resting_) return;
  session_.emergency_stop(clock_.now());
  exchange();
}

void DeterministicMotor::begin_stop(const iq::StopSettings& settings) {
  if (session_.stopping() && session_.spinning()) return;
  session_.stop(settings, clock_.now());
  exchange();
}

std::optional<iq::StopReport> DeterministicMotor::stop_report() {
  return session_.stopping() ? std::nullopt : session_.stop_report();
}

std::optional<Celsius> DeterministicMotor::coil_temperature() {
  return ask_coil_temperature(parameters_, [this](const auto& asked) { return ask(asked); });
}

std::vector<StreamEvent> DeterministicMotor::take_events() {
  std::vector<StreamEvent> events = session_.take_events();
  for (const StreamEvent& event : events)
    if (failure_.empty() && ends_a_run(event.kind)) failure_ = event.text;
  return to_events(std::move(events));
}

std::string DeterministicMotor::failure() const {
  if (!session_.failure().empty()) return "motor: " + session_.failure();
  return failure_.empty() ? "" : "motor: " + failure_;
}

}  // namespace kphi::daq
