// What a script does to the requests, to the box itself, and to its answers over HTTP and its 16-bit interface.
#include <fmt/format.h>

#include <algorithm>
#include <boost/endian/conversion.hpp>
#include <cmath>

#include "drivers/sim/netbox/fault_injector.hpp"
#include "drivers/sim/physics/motor.hpp"

namespace kphi::sim {
namespace {

constexpr double kTurn = 6.28318530717958647692;

bool on_starts(FaultKind kind) noexcept { return within(kind, FaultKind::lost_start, FaultKind::delayed_start); }

bool is_start(std::span<const std::uint8_t> datagram) noexcept {
  if (datagram.size() != 8 || boost::endian::load_big_u16(datagram.data()) != 0x1234) return false;
  const std::uint32_t command = boost::endian::load_big_u16(datagram.data() + 2);
  return command >= 1 && command <= 4;
}

/// As spoil_page, of the 16-bit interface.
void spoil_answer(const Fault& fault, StreamReply& reply) {
  const auto size = static_cast<std::size_t>(fault.size);
  if (fault.is(FaultKind::tcp_split)) {
    reply.segment = size;
    reply.pause = fault.delay;
  } else if (fault.is(FaultKind::tcp_merged)) {
    reply.wait = std::max(reply.wait, fault.delay);
  } else if (fault.is(FaultKind::tcp_short)) {
    reply.bytes.resize(std::min(reply.bytes.size(), size));
    reply.close = true;
  }
}

}  // namespace

void FaultInjector::schedule() noexcept {
  next_event_ = script_.next_event();
  if (!late_requests_.empty()) next_event_ = std::min(next_event_, late_requests_.begin()->first);
}

void FaultInjector::meet_events(Instant now) {
  while (next_event_ <= now) {
    if (const auto event = script_.take_event(next_event_)) {
      const Fault& fault = script_[event->fault];
      event->begins ? begin(event->fault) : end(fault);
      truth_.events.push_back(
          {event->at, fmt::format("{} {}", name_of(fault.kind), event->begins ? "begins" : "ends")});
    } else {
      const auto late = late_requests_.extract(late_requests_.begin());
      hand_over(late.mapped().bytes, late.mapped().peer);
    }
    disturbed_ = dead_ || skew_ != nullptr || !drifting_.empty();
    schedule();
  }
}

void FaultInjector::count_use(std::size_t fault, Instant now) {
  script_.use(fault);
  ++truth_.done[script_[fault].kind];
  truth_.events.push_back({now, std::string(name_of(script_[fault].kind))});
}

void FaultInjector::move_to(const std::string& address) {
  moved_to_ = address;
  NetBoxSettings settings = box_.settings();
  settings.address = address.empty() ? first_address_ : address;
  box_.configure(settings);
}

void FaultInjector::begin(std::size_t index) {
  const Fault& fault = script_[index];
  using K = FaultKind;
  const auto samples = static_cast<std::uint32_t>(fault.samples);
  ++truth_.done[fault.kind];
  truth_.restarts += fault.is(K::restart) && box_.streaming();
  truth_.reboots += fault.is(K::reboot);
  if (fault.is(K::taken_over)) {
    const std::uint8_t command = fault.buffered ? 3 : 2;
    hand_over(std::array<std::uint8_t, 8>{0x12, 0x34, 0, command, 0, 0, 0, 0}, kHijacker);
  }
  if (fault.is(K::restart) && box_.streaming()) box_.restart_stream();
  if (fault.is(K::reboot)) dead_ = true;
  if (fault.is(K::stall)) box_.stall(true);
  if (fault.is(K::ft_jump_back)) box_.set_ft_sequence(box_.ft_sequence() + 1 - samples);
  if (fault.is(K::overrun)) box_.set_ft_sequence(box_.ft_sequence() + 1 + samples);
  if (fault.is(K::wrap)) box_.set_ft_sequence(0u - samples);
  if (fault.is(K::clock_skew)) skew_ = &fault;
  if (fault.is(K::zero_drift)) drifting_.push_back(index);
  if (fault.is(K::status)) box_.set_status(static_cast<std::uint32_t>(fault.bits));
  if (fault.is(K::saturation)) box_.force_saturation(fault.axes);
  if (fault.is(K::frozen)) box_.freeze(fault.axes);
  if (fault.is(K::address)) move_to(fault.ip);
  NetBoxSettings settings = box_.settings();
  if (fault.is(K::rate)) settings.rate_hz = fault.rate_hz;
  if (fault.is(K::units))
    settings.slots[static_cast<std::size_t>(settings.active_slot)] = {fault.force_unit, fault.torque_unit};
  if (fault.is(K::rate) || fault.is(K::units)) box_.configure(settings);
}

void FaultInjector::end(const Fault& fault) {
  using K = FaultKind;
  if (fault.is(K::reboot)) {
    dead_ = false;
    box_.power_cycle(fault.resume);
  }
  if (fault.is(K::address)) move_to({});
  if (fault.is(K::stall)) box_.stall(false);
  if (fault.is(K::clock_skew)) skew_ = nullptr;
  if (fault.is(K::status) && !fault.latched) box_.clear_status(static_cast<std::uint32_t>(fault.bits));
  if (fault.is(K::saturation)) box_.force_saturation(0);
  if (fault.is(K::frozen)) box_.freeze(0);
}

void FaultInjector::sample_disturbed(LoadCellSample sample) {
  if (dead_) return;
  for (const std::size_t i : drifting_) {
    const Fault& fault = script_[i];
    const double since = to_seconds(sample.at - fault.at);
    sample.wrench[fault.axis] += fault.amount * -std::expm1(-since / to_seconds(fault.tau));
  }
  skew_ != nullptr ? sample_skewed(sample) : box_.sample(sample);
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
    count_use(i, now);
    if (fault.kind == FaultKind::lost_start) return;
    later = std::max(later, fault.delay);
    at_once = at_once && fault.kind == FaultKind::doubled_start;
  }
  if (at_once) hand_over(datagram, peer);
  if (later < Duration{0}) return;
  late_requests_.emplace(now + later, LateRequest{{datagram.begin(), datagram.end()}, peer});
  schedule();
}

// --- answers over stream sockets

StreamReply FaultInjector::http(std::string_view request, Instant now) {
  return spoilt(box_.http(request), now, FaultKind::http_slow, FaultKind::http_duplicate_tag);
}

StreamReply FaultInjector::tcp(std::string& received, Instant now) {
  return spoilt(box_.tcp(received), now, FaultKind::tcp_split, FaultKind::tcp_short);
}

StreamReply FaultInjector::spoilt(std::string answer, Instant now, FaultKind first, FaultKind last) {
  StreamReply reply{std::move(answer)};
  if (reply.bytes.empty()) return reply;
  for (std::size_t i = 0; i < script_.size(); ++i) {
    if (!within(script_[i].kind, first, last) || !script_.active(i, now)) continue;
    count_use(i, now);
    spoil_page(script_[i], reply);
    spoil_answer(script_[i], reply);
  }
  return reply;
}

bool FaultInjector::http_refused(Instant now) const noexcept {
  return dead_ || script_.any_active(now, [](const Fault& fault) { return fault.kind == FaultKind::http_refused; });
}

}  // namespace kphi::sim
