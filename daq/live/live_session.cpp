#include "daq/live/live_session.hpp"

#include <algorithm>

#include "daq/live/access_control.hpp"
#include "daq/live/messages.hpp"
#include "daq/live/server.hpp"

namespace kphi::daq::live {
namespace {

double calendar_seconds(const Clock& clock, Instant now) {
  const std::chrono::duration<double> epoch = clock.epoch_utc().time_since_epoch();
  return epoch.count() + to_seconds(clock.shrunk(now));
}

void add_motor(Tick& tick, const Observation& seen) {
  tick.speed_age_s = to_seconds(seen.motor_age);
  if (!seen.motor_is_fresh) return;
  tick.speed_rpm = to_rpm(seen.speed());
  tick.module_v = seen.judged[Watched::supply_voltage_low];
  tick.module_a = seen.judged[Watched::supply_current];
  tick.coil_degc = seen.judged[Watched::coil_temperature];
  tick.derate = seen.derate;
  tick.fault_bits = seen.fault_bits;
}

void add_load_cell(Tick& tick, const Observation& seen) {
  tick.thrust_age_s = to_seconds(seen.load_cell_age);
  tick.received = seen.account.received;
  tick.lost_network = seen.account.lost_network;
  tick.lost_host = seen.account.lost_host;
  if (!seen.load_cell_is_fresh) return;
  tick.thrust_n = seen.thrust_n;
  tick.torque_nm = seen.torque_nm;
}

}  // namespace

Tick LiveProgress::tick_of(const Position& position, const Observation& seen) {
  const Instant now = clock_.now();
  Tick tick;
  tick.time_s = to_seconds(now);
  tick.timestamp_s = calendar_seconds(clock_, now);
  most_remaining_s_ = std::max(most_remaining_s_, position.remaining_s);
  tick.remaining_s = position.remaining_s;
  tick.progress = most_remaining_s_ > 0 ? 1 - position.remaining_s / most_remaining_s_ : 0;
  tick.occlusion_deg = position.occlusion_deg;
  tick.repetition = position.repetition;
  tick.repetitions = position.repetitions;
  tick.step = position.step;
  tick.steps = position.steps;
  tick.commanded_rpm = to_rpm(position.commanded);
  write(tick.phase, position.step < 0 ? position.phase : "");
  write(tick.propeller, position.propeller);
  add_motor(tick, seen);
  add_load_cell(tick, seen);
  if (seen.supply.time_ns != 0) {
    tick.supply_v = seen.supply.voltage_v;
    tick.supply_a = seen.supply.current_a;
  }
  tick.watched = seen.judged;
  return tick;
}

bool LiveProgress::is_settled(Instant now) const {
  return step_ >= 0 && now - step_began_ >= from_seconds(subject_.minimum_discard.value());
}

void LiveProgress::add_to_step(const Position& position, const Observation& seen, Instant now) {
  if (position.step != step_) {
    step_ = position.step;
    step_began_ = now;
    quick_look_.begin();
  }
  if (is_settled(now) && seen.motor_is_fresh && seen.load_cell_is_fresh) quick_look_.add(seen.thrust(), seen.speed());
}

void LiveProgress::guarded(const std::vector<GuardLimit>& limits) {
  inner_.guarded(limits);
  feed_.tell(limits_message(limits));
  if (plotter_ != nullptr) plotter_->hold_to(limits);
}

void LiveProgress::tick(const Position& position, const Observation& seen) {
  inner_.tick(position, seen);
  add_to_step(position, seen, clock_.now());
  const Tick tick = tick_of(position, seen);
  feed_.show(tick);
  if (plotter_ != nullptr) plotter_->send(tick);
}

void LiveProgress::step_done(const Position& position, const Observation& seen) {
  inner_.step_done(position, seen);
  if (position.step < 0) return;
  const QuickLook::Result result = quick_look_.result();
  if (result.n > 0) feed_.tell(step_message(tick_of(position, seen), result));
}

void LiveProgress::say(const std::string& line) {
  inner_.say(line);
  feed_.tell(line_message(to_seconds(clock_.now()), line));
}

LiveSession::LiveSession(const LiveOptions& options, Subject subject) : subject_(std::move(subject)) {
  if (!options.udp_json.empty()) plotter_ = std::make_unique<UdpJson>(options.udp_json, subject_.limits);
  if (!options.port) return;
  Server::Settings settings;
  settings.port = *options.port;
  settings.token = new_token();
  settings.page = page_text();
  settings.hello = hello_message(subject_);
  settings.can_stop = !subject_.replay;
  server_ = std::make_unique<Server>(std::move(settings), feed_);
}

std::unique_ptr<Progress> LiveSession::beside(Progress& behind, const Clock& clock) {
  clock_ = &clock;
  return std::make_unique<LiveProgress>(behind, feed_, plotter_.get(), subject_, clock);
}

void LiveSession::end(bool well, const std::string& words) {
  feed_.tell(end_message(clock_ != nullptr ? to_seconds(clock_->now()) : 0, well, words));
}

}  // namespace kphi::daq::live
