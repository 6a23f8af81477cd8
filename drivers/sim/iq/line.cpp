#include "drivers/sim/iq/line.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "drivers/sim/iq/frame.hpp"
#include "drivers/sim/transport/bytes.hpp"

namespace kphi::sim {
namespace {

constexpr double kBitsPerByte = 10;       // 8N1
constexpr double kRateTolerance = 0.045;  // beyond it the stop bit is missed
constexpr std::uint8_t kReplyCode = 3;
constexpr std::array<std::uint32_t, 3> kOtherUid{0x00410018, 0x4d4b5022, 0x20343354};

/// Faults of a moment or a span; all others of the motor wait for replies or bytes.
bool is_event(const Fault& fault) noexcept {
  return within(fault.kind, FaultKind::motor_mute, FaultKind::motor_locked) &&
         fault.kind != FaultKind::motor_command_flip;
}

}  // namespace

IqLine::IqLine(IqDevice& module, const IqLineSettings& settings, FaultScript script, std::uint64_t seed, Keep keep)
    : module_(module), settings_(settings), script_(std::move(script), seed), keep_(keep), stuck_(script_.size()) {
  for (std::size_t i = 0; i < script_.size(); ++i) {
    if (is_event(script_[i])) script_.plan(i);
  }
}

void IqLine::send(std::span<const std::uint8_t> bytes, Instant now) {
  truth_.bytes_from_host += bytes.size();
  if (!plugged_) return;
  const Duration each = byte_time(host_rate_ > 0 ? host_rate_ : module_.line_rate());
  for (const std::uint8_t byte : bytes) {
    host_free_ = std::max(host_free_, now) + each;
    to_module_.push_back({host_free_, byte});
  }
}

void IqLine::advance(Instant now) {
  meet_events(now);
  carry_commands(now);
  take_replies(now);
  if (hold_until_ <= now) release(hold_until_);
  arrive(now);
}

bool IqLine::next_chunk(IqChunk& out, Instant now) {
  if (chunks_.empty() || chunks_.front().at > now) return false;
  out = std::move(chunks_.front());
  chunks_.pop_front();
  return true;
}

Instant IqLine::next_event() const noexcept {
  Instant next = std::min(module_.next_reply_at(), script_.next_event());
  if (!to_module_.empty()) next = std::min(next, to_module_.front().due);
  if (!to_host_.empty()) next = std::min(next, arrival_of(to_host_.front()));
  if (!chunks_.empty()) next = std::min(next, chunks_.front().at);
  if (held_) next = std::min(next, hold_until_);
  return next;
}

// --- to the module

void IqLine::carry_commands(Instant now) {
  while (!to_module_.empty() && to_module_.front().due <= now) {
    Byte carried = to_module_.front();
    to_module_.pop_front();
    take_replies(carried.due);
    if (deaf_) continue;
    if (!rates_match()) carried.byte = random_byte();
    for (std::size_t i = 0; i < script_.size(); ++i) {
      if (script_[i].kind != FaultKind::motor_command_flip || !script_.active(i, carried.due) ||
          !script_.chance(script_[i].p))
        continue;
      carried.byte ^= static_cast<std::uint8_t>(1u << (script_.bits() & 7));
      script_.use(i);
      ++truth_.done[FaultKind::motor_command_flip];
    }
    ++truth_.bytes_to_module;
    module_.receive({&carried.byte, 1}, carried.due);
  }
}

// --- from the module

void IqLine::take_replies(Instant now) {
  IqReply reply;
  while (module_.next_reply(reply, now)) carry(reply);
}

void IqLine::carry(const IqReply& reply) {
  ++truth_.replies;
  FaultDecision decision;
  decision.reply = {reply};
  decision.passage.ready = reply.at;
  for (std::size_t i = 0; i < script_.size(); ++i) {
    if (!script_.active(i, reply.at) || !concerns(script_[i], reply) || !script_.chance(script_[i].p)) continue;
    script_.use(i);
    ++truth_.done[script_[i].kind];
    decision.reply.done.insert(script_[i].kind);
    act(i, decision);
  }
  if (decision.overtaken_for && !decision.dropped && !held_) {
    hold_until_ = reply.at + *decision.overtaken_for;
    held_ = std::move(decision);
    return;
  }
  emit(decision);
  release(reply.at);
}

void IqLine::act(std::size_t index, FaultDecision& decision) {
  const Fault& fault = script_[index];
  IqReply& reply = decision.reply;
  Passage& passage = decision.passage;
  using K = FaultKind;
  // The reply itself.
  if (fault.is(K::motor_drop)) decision.dropped = true;
  if (fault.is(K::motor_duplicate)) ++decision.copies;
  if (fault.is(K::motor_reorder)) decision.overtaken_for = fault.delay;
  if (fault.is(K::motor_value) && reply.size == 4)
    put_little(reply.bytes.data(), std::bit_cast<std::uint32_t>(static_cast<float>(fault.reading)), 4);
  if (fault.is(K::motor_wrong_length)) reply.size = static_cast<std::uint8_t>(fault.size);
  if (fault.is(K::motor_wrong_id)) reply.id = static_cast<std::uint8_t>(fault.id);
  if (fault.is(K::motor_stuck))
    reply.bytes = stuck_[index].try_emplace(iq_key(reply.type, reply.sub), reply).first->second.bytes;
  // Its bytes.
  if (fault.is(K::motor_flip)) decision.flips += fault.bits;
  if (fault.is(K::motor_bad_crc)) decision.bad_crc = true;
  if (fault.is(K::motor_truncate)) decision.truncated = static_cast<std::size_t>(fault.size);
  if (fault.is(K::motor_garbage)) {
    for (std::size_t i = 0; fault.bytes.empty() && i < fault.size; ++i) decision.before.push_back(random_byte());
    decision.before.insert(decision.before.end(), fault.bytes.begin(), fault.bytes.end());
  }
  // When they come.
  const std::int64_t period = std::max<std::int64_t>(1, fault.delay.count());
  if (fault.is(K::motor_merge)) passage.together = Instant((reply.at.count() / period + 1) * period);
  if (fault.is(K::motor_split)) passage.between = fault.delay;
  if (fault.is(K::motor_stall)) {
    passage.stall_after = static_cast<std::size_t>(fault.size);
    passage.stall = fault.delay;
  }
  if (fault.is(K::motor_delay))
    passage.ready += fault.delay + from_seconds(script_.uniform() * to_seconds(fault.jitter));
}

void IqLine::emit(const FaultDecision& decision) {
  const std::size_t entry = truth_.log.size();
  if (keep_ == Keep::replies) truth_.log.push_back(decision.reply);
  if (decision.dropped) {
    ++truth_.spoilt;
    return;
  }
  if (!decision.before.empty()) {
    Passage garbage;
    garbage.bytes = decision.before;
    garbage.ready = decision.passage.ready;
    garbage.together = decision.passage.together;
    schedule(std::move(garbage));
  }
  for (int copy = 0; copy < decision.copies; ++copy) put(decision, entry);
}

void IqLine::put(const FaultDecision& decision, std::size_t entry) {
  Passage passage = decision.passage;
  passage.entry = entry;
  append_iq_frame(passage.bytes, decision.reply.type, decision.reply.sub,
                  static_cast<std::uint8_t>(decision.reply.id << 2 | kReplyCode), decision.reply.data());
  const std::vector<std::uint8_t> intact = passage.bytes;
  if (decision.bad_crc) passage.bytes.back() ^= 0x5a;
  for (std::uint64_t i = 0; i < decision.flips; ++i) {
    const std::uint64_t place = script_.bits() % (8 * passage.bytes.size());
    passage.bytes[place / 8] ^= static_cast<std::uint8_t>(1u << (place % 8));
  }
  if (decision.truncated) passage.bytes.resize(std::min(passage.bytes.size(), *decision.truncated));
  passage.whole = passage.bytes == intact;
  schedule(std::move(passage));
}

void IqLine::schedule(Passage passage) {
  truth_.bytes_from_module += passage.bytes.size();
  if (!passage.whole) ++truth_.spoilt;
  if (passage.bytes.empty()) return;
  to_host_.push_back(std::move(passage));
}

/// Sends what was held back.
void IqLine::release(Instant at) {
  if (!held_) return;
  held_->passage.ready = std::max(held_->passage.ready, at);
  emit(*std::exchange(held_, std::nullopt));
}

/// When the next byte of what is first in the line reaches the host's port.
Instant IqLine::arrival_of(const Passage& passage) const noexcept {
  const Duration each = byte_time(module_.line_rate());
  const Instant begun = passage.begun >= Instant{0} ? passage.begun : std::max(passage.ready, module_free_);
  Instant at = begun + (each + passage.between) * static_cast<std::int64_t>(passage.done + 1) - passage.between;
  if (passage.stall > Duration{0} && passage.done >= passage.stall_after) at += passage.stall;
  if (passage.together) at = std::max(at, *passage.together);
  return std::max(handed_over(at), last_arrival_);
}

void IqLine::arrive(Instant now) {
  while (!to_host_.empty()) {
    Passage& passage = to_host_.front();
    const Instant at = arrival_of(passage);
    if (at > now) return;
    last_arrival_ = at;
    if (passage.begun < Instant{0}) {
      passage.begun = std::max(passage.ready, module_free_);
      if (keep_ == Keep::replies && passage.entry < truth_.log.size() && passage.whole)
        truth_.log[passage.entry].begun = passage.begun;
    }
    std::uint8_t byte = passage.bytes[passage.done++];
    const bool lost = mute_ || !plugged_;
    const bool garbled = !lost && !rates_match();
    if (garbled) byte = random_byte();
    passage.spoilt = passage.spoilt || lost || garbled;
    if (!lost) {
      ++truth_.bytes_to_host;
      if (chunks_.empty() || chunks_.back().at != at) chunks_.push_back({at, {}});
      chunks_.back().bytes.push_back(byte);
    }
    if (passage.done < passage.bytes.size()) continue;
    finish(passage, at);
    to_host_.pop_front();
  }
}

void IqLine::finish(const Passage& passage, Instant at) {
  const Duration each = byte_time(module_.line_rate()) + passage.between;
  module_free_ = passage.begun + each * static_cast<std::int64_t>(passage.bytes.size()) + passage.stall;
  if (!passage.whole) return;
  if (passage.spoilt) {
    ++truth_.spoilt;
    return;
  }
  ++truth_.frames_arrived;
  if (keep_ == Keep::totals) return;
  SentIqReply& sent = truth_.log[passage.entry];
  if (sent.arrivals++ == 0) sent.arrived = at;
}

// --- the script

bool IqLine::concerns(const Fault& fault, const IqReply& reply) const noexcept {
  if (!within(fault.kind, FaultKind::motor_flip, FaultKind::motor_stuck)) return false;
  return (fault.type < 0 || fault.type == reply.type) && (fault.sub < 0 || fault.sub == reply.sub);
}

void IqLine::meet_events(Instant now) {
  while (const auto event = script_.take_event(now)) {
    carry_commands(event->at);
    take_replies(event->at);
    arrive(event->at);
    const Fault& fault = script_[event->fault];
    event->begins ? begin(fault, event->at) : end(fault, event->at);
    recompute(event->at);
  }
}

void IqLine::begin(const Fault& fault, Instant now) {
  ++truth_.done[fault.kind];
  note(now, fault, fault.lasts > Duration{0} ? " begins" : "");
  if (fault.kind == FaultKind::motor_brown_out) {
    module_.brown_out(now, fault.down);
    cut();
  }
  if (fault.kind == FaultKind::motor_baud) module_.set_baud(static_cast<unsigned>(fault.baud));
  if (fault.kind == FaultKind::motor_unplug) cut();
}

void IqLine::end(const Fault& fault, Instant now) {
  note(now, fault, " ends");
  if (fault.kind != FaultKind::motor_unplug || !fault.other) return;
  module_.replace(kOtherUid);
  module_.brown_out(now, Duration{0});
}

void IqLine::recompute(Instant now) {
  mute_ = deaf_ = false;
  plugged_ = true;
  upset_ = {};
  IqUpset module;
  for (const Fault& fault : script_.faults()) {
    if (!is_event(fault) || !fault.active(now)) continue;
    mute_ = mute_ || fault.kind == FaultKind::motor_mute;
    deaf_ = deaf_ || fault.kind == FaultKind::motor_deaf;
    plugged_ = plugged_ && fault.kind != FaultKind::motor_unplug;
    module.deaf_to_sets = module.deaf_to_sets || fault.kind == FaultKind::motor_ignore_sets;
    if (fault.kind == FaultKind::motor_redline) module.redline = fault.speed;
    if (fault.kind == FaultKind::motor_hot) {
      module.heat.coil += fault.coil;
      module.heat.controller += fault.controller;
    }
    if (fault.kind == FaultKind::motor_over_voltage) upset_.supply_volts += fault.volts;
    if (fault.kind == FaultKind::motor_sag) upset_.supply_volts -= fault.volts;
    upset_.locked = upset_.locked || fault.kind == FaultKind::motor_locked;
  }
  module_.upset(module);
}

void IqLine::note(Instant at, const Fault& fault, const char* what) {
  truth_.events.push_back({at, std::string(name_of(fault.kind)) + what});
}

/// Drops all bytes in flight.
void IqLine::cut() noexcept {
  for (const Passage& passage : to_host_) truth_.spoilt += passage.whole ? 1 : 0;
  to_host_.clear();
  to_module_.clear();
  held_.reset();
}

// --- rate and adapter

Duration IqLine::byte_time(double rate) const noexcept {
  if (!settings_.paced || rate <= 0) return Duration{0};
  return from_seconds(kBitsPerByte / rate * settings_.time_scale);
}

bool IqLine::rates_match() const noexcept {
  return host_rate_ <= 0 || std::abs(module_.line_rate() / host_rate_ - 1) <= kRateTolerance;
}

Instant IqLine::handed_over(Instant at) const noexcept {
  const auto tick = static_cast<std::int64_t>(static_cast<double>(settings_.usb_tick.count()) * settings_.time_scale);
  if (tick <= 0) return at;
  return Instant((at.count() + tick - 1) / tick * tick);
}

}  // namespace kphi::sim
