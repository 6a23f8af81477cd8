#include "test/drivers/iq_faults/joined.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <map>

namespace kphi::iq::test {
namespace {

using namespace std::chrono_literals;

constexpr Duration kTick = 142858ns;
constexpr Duration kCommandEvery = 400ms;
constexpr Duration kReconnectAfter = 200ms;
constexpr std::array<double, 5> kSpeeds{300, 600, 900, 450, 700};

sim::IqSettings module_settings(const Manner& manner, std::uint64_t seed) {
  sim::IqSettings settings;
  settings.module_id = manner.module_id;
  settings.baud = manner.baud;
  settings.reply_latency = manner.reply_latency;
  settings.reply_jitter = manner.reply_jitter;
  settings.quirks = manner.quirks;
  settings.seed = seed;
  return settings;
}

Settings session_settings(const Manner& manner) {
  Settings settings;
  settings.module_id = manner.module_id;
  settings.telemetry_hz = manner.telemetry_hz;
  settings.slow_hz = manner.slow_hz;
  settings.every_cycle = manner.every_cycle;
  settings.wire_byte_time = manner.paced ? from_seconds(10.0 / manner.baud) : Duration{0};
  settings.wire_paces = manner.paced;
  settings.module_timeout_s = manner.module_timeout_s;
  return settings;
}

struct Key {
  std::uint8_t type, sub;
  friend auto operator<=>(const Key&, const Key&) = default;
};

Key key_of(MotorChannel quantity, bool legacy) {
  static const std::map<MotorChannel, Key> kKeys{
      {MotorChannel::speed, {50, 13}},         {MotorChannel::supply_voltage, {69, 0}},
      {MotorChannel::supply_current, {69, 1}}, {MotorChannel::motor_current, {50, 36}},
      {MotorChannel::derate, {50, 41}},        {MotorChannel::drive_mode, {50, 0}},
      {MotorChannel::drive_pwm, {50, 8}},      {MotorChannel::fault_now, {84, 0}}};
  if (quantity == MotorChannel::coil_temperature) return legacy ? Key{77, 0} : Key{83, 0};
  return kKeys.at(quantity);
}

std::uint32_t bits_of(std::span<const std::uint8_t> data) {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < data.size() && i < 4; ++i) bits |= static_cast<std::uint32_t>(data[i]) << (8 * i);
  return bits;
}

std::uint32_t bits_of(const MotorReading& reading) {
  if (reading.channel == MotorChannel::drive_mode || reading.channel == MotorChannel::fault_now)
    return static_cast<std::uint32_t>(reading.value);
  if (reading.channel == MotorChannel::derate) return static_cast<std::uint32_t>(std::lround(reading.value * 65536));
  return std::bit_cast<std::uint32_t>(static_cast<float>(reading.value));
}

bool is_motion(const sim::IqFrame& frame) {
  const int sub = frame.payload[0];
  if (frame.type == 52) return (sub >= 3 && sub <= 6) || sub == 21;
  return frame.type == 50 && sub >= 1 && sub <= 4;
}

bool is_coast(const sim::IqFrame& frame) {
  return (frame.type == 52 && frame.payload[0] == 2) || (frame.type == 50 && frame.payload[0] == 6);
}

}  // namespace

Joined::Joined(const Manner& manner, sim::FaultScript script, std::uint64_t seed)
    : manner_(manner),
      plant_({}, seed),
      module_(module_settings(manner, seed), plant_.motor()),
      line_(module_, {manner.paced, 1, manner.usb_tick}, std::move(script), ~seed, sim::IqLine::Keep::replies),
      session_(session_settings(manner)) {
  plant_.mount(sim::find_propeller("5x3"), 0);
  line_.host_rate(manner.baud);
  session_.connect(Instant{0});
}

void Joined::run_until(Instant end) {
  for (;;) {
    const Instant at(static_cast<std::int64_t>((tick_ + 1) * 1'000'000 / 7));
    if (at > end) return;
    ++tick_;
    line_.advance(at);
    module_.advance(at);
    plant_.upset(line_.upset());
    plant_.step(module_.stage());
    pump(at);
  }
}

void Joined::finish() {
  may_spin_ = false;
  session_.coast(now());
  run_until(now() + 2s);
}

void Joined::waver() {
  session_.spin_at(RadPerSec(500), now());
  session_.coast(now());
  coasted_ = true;
}

void Joined::pump(Instant now) {
  follow_the_plug(now);
  sim::IqChunk chunk;
  while (line_.next_chunk(chunk, now)) session_.receive(chunk.bytes, chunk.at);
  if (session_.deadline() <= now) session_.advance(now);
  connect_again(now);
  command(now);
  for (StreamEvent& event : session_.take_events()) events_.push_back(std::move(event));
  auto output = was_plugged_ ? session_.output() : std::span<const std::uint8_t>{};
  if (manner_.port_takes > 0) output = output.first(std::min(output.size(), manner_.port_takes));
  if (!output.empty()) {
    watch(output, now);
    line_.send(output, now);
    session_.sent(output.size());
  }
  std::array<MotorReading, 64> taken;
  for (std::size_t n = session_.take(taken); n > 0; n = session_.take(taken)) {
    readings_.insert(readings_.end(), taken.begin(), taken.begin() + static_cast<std::ptrdiff_t>(n));
    received_.insert(received_.end(), n, now);
  }
}

// As the owner of a port does.
void Joined::follow_the_plug(Instant now) {
  if (line_.plugged() == was_plugged_) return;
  was_plugged_ = line_.plugged();
  if (!was_plugged_) return session_.fail(EventKind::motor_port_lost, "the port is gone", now);
  ++connects_;
  session_.connect_anew(now);
}

// As the owner of a port does: who asks a module that does not hear the coast keeps it alive.
void Joined::connect_again(Instant now) {
  const bool failed = session_.state() == Session::State::failed;
  if (failed && !was_failed_) {
    if (failures_++ == 0) first_failure_ = session_.failure();
    may_spin_ = false;
    reconnect_at_ = now + kReconnectAfter;
  }
  was_failed_ = failed;
  if (!failed || !was_plugged_ || !session_.coasting() || now < reconnect_at_) return;
  ++connects_;
  session_.connect(now);
}

void Joined::command(Instant now) {
  if (session_.state() != Session::State::ready) return;
  if (ready_at_ < Instant{0}) ready_at_ = now;
  if (!may_spin_ || now < next_command_) return;
  next_command_ = now + kCommandEvery;
  session_.spin_at(RadPerSec(kSpeeds[static_cast<std::size_t>(commands_++) % kSpeeds.size()]), now);
  coasted_ = false;
}

void Joined::watch(std::span<const std::uint8_t> bytes, Instant now) {
  host_frames_.feed(bytes);
  while (const auto frame = host_frames_.next()) {
    if (frame->payload.size() < 2 || (frame->payload[1] & 3) != 1) continue;
    if (is_coast(*frame)) coasted_ = true;
    if (!is_motion(*frame) || !coasted_) continue;
    ++forbidden_motions_;
    if (forbidden_at_ < Instant{0}) forbidden_at_ = now;
  }
}

Duration Joined::silence_after(Instant after) const {
  for (std::size_t i = 0; i < readings_.size(); ++i) {
    if (readings_[i].channel == MotorChannel::speed && received_[i] > after) return received_[i] - after;
  }
  return 10h;
}

bool Joined::saw(EventKind kind) const {
  return std::any_of(events_.begin(), events_.end(), [&](const StreamEvent& event) { return event.kind == kind; });
}

std::string Joined::danger() const {
  std::string out;
  if (forbidden_motions_ > 0) {
    out += fmt::format("{} motion commands after a coast, the first at {:.4f} s\n", forbidden_motions_,
                       to_seconds(forbidden_at_));
  }
  if (module_.drive().mode != sim::MotorDrive::Mode::coast ||
      (module_.stage().mode != sim::PowerStage::Mode::coast && !module_.singing()))
    out += "the motor does not coast at the end\n";
  return out;
}

std::string Joined::disagreement() const {
  const Counters& account = session_.counters();
  const sim::IqTruth& truth = line_.truth();
  std::string out;
  const auto compare = [&](const char* what, std::uint64_t driver, std::uint64_t simulator) {
    if (driver != simulator) out += fmt::format("{}: driver {}, truth {}\n", what, driver, simulator);
  };
  compare("bytes in", account.bytes_in, truth.bytes_to_host);
  compare("bytes out", account.bytes_out, truth.bytes_from_host);
  // A frame that is given up for want of its rest is counted as a resync, and may come whole after all.
  const bool lost = connects_ == 1 && account.packets + account.resyncs < truth.frames_arrived;
  if (lost || account.packets > truth.frames_arrived)
    out += fmt::format("packets: driver {} and {} given up, truth {}\n", account.packets, account.resyncs,
                       truth.frames_arrived);
  compare("uses of packets", account.replies + account.late_replies + account.unasked + account.wrong_module,
          account.packets);
  const std::uint64_t ended = account.replies + account.timeouts;
  if (ended > account.requests || account.requests - ended > 10)
    out += fmt::format("requests {}: {} answered, {} timed out\n", account.requests, account.replies, account.timeouts);
  compare("dropped readings", account.dropped_readings, 0);
  return out + wrong_readings();
}

/// Each reading is a value that the module sent whole for that entry under its id, none is delivered twice, and the
/// moment at which the module took it lies within what the driver claims.
std::string Joined::wrong_readings() const {
  const Duration slack = 2 * kTick + 50us;
  std::map<Key, std::vector<const sim::SentIqReply*>> sent;
  for (const auto& reply : line_.truth().log) {
    if (reply.arrivals > 0 && reply.id == manner_.module_id) sent[{reply.type, reply.sub}].push_back(&reply);
  }
  std::map<Key, std::size_t> next;
  std::string out;
  int wrong = 0;
  for (std::size_t i = 0; i < readings_.size(); ++i) {
    const MotorReading& reading = readings_[i];
    const Key key = key_of(reading.channel, manner_.quirks.legacy);
    const auto& candidates = sent[key];
    const std::size_t none = candidates.size();
    std::size_t best = none;
    Duration least = Duration::max();
    for (std::size_t j = next[key]; j < candidates.size() && candidates[j]->asked <= received_[i]; ++j) {
      const Duration away(std::abs((candidates[j]->asked.count() - reading.time_ns)));
      if (bits_of(candidates[j]->data()) == bits_of(reading) && away < least) {
        least = away;
        best = j;
      }
    }
    const bool untrue = best == none;
    if (!untrue) next[key] = best + 1;
    if (!untrue && least <= Duration(reading.uncertainty_ns) + slack) continue;
    if (++wrong > 3) continue;
    out += untrue ? fmt::format("{} {} at {:.4f} s was never sent\n", name_of(reading.channel), reading.value,
                                to_seconds(received_[i]))
                  : fmt::format("{} {} was taken {:.4f} s off the {:.4f} ± {:.4f} s that the driver claims\n",
                                name_of(reading.channel), reading.value, to_seconds(least),
                                1e-9 * static_cast<double>(reading.time_ns),
                                1e-9 * static_cast<double>(reading.uncertainty_ns));
  }
  if (wrong > 3) out += fmt::format("... {} wrong readings in all\n", wrong);
  return out;
}

sim::FaultScript script(std::initializer_list<sim::FaultEntry> entries) {
  sim::FaultScript faults;
  for (const sim::FaultEntry& entry : entries) faults.push_back(sim::fault_of(entry));
  return faults;
}

}  // namespace kphi::iq::test
