// What a script does to the requests, to the box itself, and to its answers over HTTP and its 16-bit interface.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/sim/netbox/fault_injector.hpp"
#include "drivers/sim/physics/motor.hpp"
#include "drivers/sim/transport/bytes.hpp"

namespace kphi::sim {
namespace {

constexpr double kTurn = 6.28318530717958647692;

bool is_start(std::span<const std::uint8_t> datagram) noexcept {
  if (datagram.size() != 8 || big(datagram.first(2)) != 0x1234) return false;
  const std::uint32_t command = big(datagram.subspan(2, 2));
  return command >= 1 && command <= 4;
}

void spoil_answer(const Fault& fault, StreamReply& reply) {
  const auto size = static_cast<std::size_t>(fault.size);
  if (fault.kind == FaultKind::tcp_split) {
    reply.segment = size;
    reply.pause = fault.delay;
  } else if (fault.kind == FaultKind::tcp_merged) {
    reply.wait = std::max(reply.wait, fault.delay);
  } else {
    reply.bytes.resize(std::min(reply.bytes.size(), size));
    reply.close = true;
  }
}

}  // namespace

void FaultInjector::schedule() noexcept {
  next_event_ = script_.next_event();
  for (const LateRequest& request : late_requests_) next_event_ = std::min(next_event_, request.due);
}

void FaultInjector::meet_events(Instant now) {
  while (next_event_ <= now) {
    if (const auto event = script_.take_event(next_event_)) {
      const Fault& fault = script_[event->fault];
      event->begins ? begin(event->fault) : end(fault);
      note(event->at, fmt::format("{} {}", name_of(fault.kind), event->begins ? "begins" : "ends"));
    } else {
      const auto due = std::find_if(late_requests_.begin(), late_requests_.end(),
                                    [&](const LateRequest& r) { return r.due == next_event_; });
      const LateRequest request = std::move(*due);
      late_requests_.erase(due);
      hand_over(request.bytes, request.peer);
    }
    schedule();
  }
}

void FaultInjector::note(Instant at, std::string what) { truth_.events.push_back({at, std::move(what)}); }

void FaultInjector::count_use(std::size_t fault, Instant now, std::uint64_t WireTruth::*counter) {
  script_.use(fault);
  ++(truth_.*counter);
  note(now, std::string(name_of(script_[fault].kind)));
}

void FaultInjector::move_to(const std::string& address) {
  moved_to_ = address;
  NetBoxSettings settings = box_.settings();
  settings.address = address.empty() ? first_address_ : address;
  box_.configure(settings);
}

void FaultInjector::begin(std::size_t index) {
  const Fault& fault = script_[index];
  switch (fault.kind) {
    case FaultKind::taken_over: {
      const std::array<std::uint8_t, 8> start{0x12, 0x34, 0, static_cast<std::uint8_t>(fault.buffered ? 3 : 2),
                                              0,    0,    0, 0};
      ++truth_.takeovers;
      return hand_over(start, kHijacker);
    }
    case FaultKind::restart:
      if (!box_.streaming()) return;
      ++truth_.restarts;
      return box_.restart_stream();
    case FaultKind::reboot:
      ++truth_.reboots;
      dead_ = disturbed_ = true;
      return;
    case FaultKind::stall:
      ++truth_.stalls;
      return box_.stall(true);
    case FaultKind::ft_jump_back:
      ++truth_.jumps;
      return box_.set_ft_sequence(box_.ft_sequence() + 1 - static_cast<std::uint32_t>(fault.samples));
    case FaultKind::overrun:
      ++truth_.overruns;
      return box_.set_ft_sequence(box_.ft_sequence() + 1 + static_cast<std::uint32_t>(fault.samples));
    case FaultKind::wrap:
      return box_.set_ft_sequence(0u - static_cast<std::uint32_t>(fault.samples));
    case FaultKind::clock_skew:
      skew_ = &fault;
      skewed_ = disturbed_ = true;
      return;
    case FaultKind::zero_drift:
      drifting_.push_back(index);
      disturbed_ = true;
      return;
    case FaultKind::rate: {
      ++truth_.rate_changes;
      NetBoxSettings settings = box_.settings();
      settings.rate_hz = fault.rate_hz;
      return box_.configure(settings);
    }
    case FaultKind::address:
      ++truth_.moves;
      return move_to(fault.address);
    case FaultKind::status:
      return box_.set_status(fault.bits);
    case FaultKind::saturation:
      return box_.force_saturation(fault.axes);
    case FaultKind::units: {
      NetBoxSettings settings = box_.settings();
      Slot& slot = settings.slots[static_cast<std::size_t>(settings.active_slot)];
      slot.force_unit = fault.force_unit;
      slot.torque_unit = fault.torque_unit;
      return box_.configure(settings);
    }
    default:
      return;
  }
}

void FaultInjector::end(const Fault& fault) {
  switch (fault.kind) {
    case FaultKind::reboot:
      dead_ = false;
      disturbed_ = skewed_ || !drifting_.empty();
      return box_.power_cycle(fault.resume);
    case FaultKind::address:
      return move_to({});
    case FaultKind::stall:
      return box_.stall(false);
    case FaultKind::clock_skew:
      skewed_ = false;
      disturbed_ = dead_ || !drifting_.empty();
      return;
    case FaultKind::status:
      if (!fault.latched) box_.clear_status(fault.bits);
      return;
    case FaultKind::saturation:
      return box_.force_saturation(0);
    default:
      return;
  }
}

void FaultInjector::sample_disturbed(LoadCellSample sample) {
  if (dead_) return;
  for (const std::size_t i : drifting_) {
    const Fault& fault = script_[i];
    const double since = to_seconds(sample.at - fault.at);
    sample.wrench[fault.axis] += fault.amount * -std::expm1(-since / to_seconds(fault.tau));
  }
  skewed_ ? sample_skewed(sample) : box_.sample(sample);
}

void FaultInjector::sample_skewed(const LoadCellSample& sample) {
  const double turn = kTurn * to_seconds(sample.at - skew_->at) / to_seconds(skew_->period);
  const double rate = 1 + 1e-6 * (skew_->ppm + (skew_->wander_ppm == 0 ? 0 : skew_->wander_ppm * std::sin(turn)));
  phase_ += rate;
  const int crossed = static_cast<int>(phase_);
  phase_ -= crossed;
  // Forces change little within a tick; the time of the sample is exact.
  for (int left = crossed - 1; left >= 0; --left) {
    box_.sample({sample.at - from_seconds((phase_ + left) / rate * kTick), sample.wrench});
  }
}

void FaultInjector::hand_over(std::span<const std::uint8_t> datagram, Peer peer) {
  if (dead_) {
    ++truth_.unheard;
    return;
  }
  box_.receive(datagram, peer);
}

void FaultInjector::request(std::span<const std::uint8_t> datagram, Peer peer, Instant now) {
  if (now >= next_event_) meet_events(now);
  if (!is_start(datagram)) return hand_over(datagram, peer);
  ++truth_.starts;
  Duration later{-1};
  bool at_once = true;
  for (std::size_t i = 0; i < script_.size(); ++i) {
    const Fault& fault = script_[i];
    if (!on_starts(fault.kind) || !script_.active(i, now)) continue;
    if (fault.kind == FaultKind::lost_start) return count_use(i, now, &WireTruth::starts_lost);
    const bool doubled = fault.kind == FaultKind::doubled_start;
    count_use(i, now, doubled ? &WireTruth::starts_doubled : &WireTruth::starts_delayed);
    later = std::max(later, fault.delay);
    at_once = at_once && doubled;
  }
  if (at_once) hand_over(datagram, peer);
  if (later < Duration{0}) return;
  late_requests_.push_back({now + later, {datagram.begin(), datagram.end()}, peer});
  schedule();
}

// --- answers over stream sockets

StreamReply FaultInjector::http(std::string_view request, Instant now) {
  StreamReply reply;
  reply.bytes = box_.http(request);
  for (std::size_t i = 0; i < script_.size(); ++i) {
    if (!on_pages(script_[i].kind) || !script_.active(i, now)) continue;
    count_use(i, now, &WireTruth::http_spoilt);
    spoil_page(script_[i], reply);
  }
  return reply;
}

bool FaultInjector::http_refused(Instant now) const noexcept {
  if (dead_) return true;
  for (std::size_t i = 0; i < script_.size(); ++i) {
    if (script_[i].kind == FaultKind::http_refused && script_.active(i, now)) return true;
  }
  return false;
}

StreamReply FaultInjector::tcp(std::string& received, Instant now) {
  StreamReply reply;
  reply.bytes = box_.tcp(received);
  for (std::size_t i = 0; i < script_.size() && !reply.bytes.empty(); ++i) {
    if (!on_tcp(script_[i].kind) || !script_.active(i, now)) continue;
    count_use(i, now, &WireTruth::tcp_spoilt);
    spoil_answer(script_[i], reply);
  }
  return reply;
}

}  // namespace kphi::sim
