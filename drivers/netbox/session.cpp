#include "drivers/netbox/session.hpp"

#include <algorithm>

namespace kphi::netbox {
namespace {

// A stop that the box did not hear shows as datagrams that do not end: so many settle times are enough.
constexpr int kDrainLimit = 20;
// A new stream counts from 1. What is further on than this many datagrams belongs to the one before.
constexpr std::uint32_t kFirstDatagrams = 64;

}  // namespace

Duration StreamSettings::datagram_period() const noexcept {
  return from_seconds((buffered ? records_per_datagram : 1) * (divisor / device_rate_hz));
}

Session::Session(StreamSettings settings)
    : settings_(settings),
      silence_(settings.silence_timeout + 3 * settings.datagram_period()),
      account_(settings.divisor, settings.device_rate_hz),
      datagram_records_(settings.buffered ? static_cast<std::size_t>(settings.records_per_datagram) : 1) {}

void Session::start(Instant now) {
  if (phase_ == Phase::idle || phase_ == Phase::failed) account_.begin_segment();
  attempt_ = 0;
  request_count_ = 0;
  send_stop(now);
  phase_ = Phase::draining;
  due_ = now + settings_.settle;
  drain_limit_ = now + kDrainLimit * settings_.settle;
}

void Session::stop(Instant now) {
  request_count_ = 0;
  send_stop(now);
  phase_ = Phase::idle;
  due_ = kNever;
}

void Session::receive(std::span<const std::uint8_t> datagram, Instant arrival, std::vector<StampedRecord>& out) {
  Counters& counters = account_.counters();
  ++counters.datagrams;
  const std::size_t count = decode(datagram, decoded_);
  if (count == 0) {
    ++counters.malformed;
    return;
  }
  if (phase_ != Phase::streaming) {
    const bool expected = phase_ == Phase::silent || (phase_ == Phase::awaiting && belongs_to_new_stream(decoded_[0]));
    if (!expected) return discard(arrival);
  }
  datagram_records_ = count;
  const std::size_t before = out.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (account_.accept(decoded_[i], arrival)) out.push_back({decoded_[i], arrival});
  }
  if (out.size() == before) return;
  phase_ = Phase::streaming;
  due_ = arrival + silence_;
}

void Session::advance(Instant now) {
  if (now < due_) return;
  switch (phase_) {
    case Phase::draining:
      return send_start(now);
    case Phase::awaiting:
      if (attempt_ < settings_.attempts) return send_start(now);
      stop(now);
      phase_ = Phase::failed;
      return;
    case Phase::streaming:
      phase_ = Phase::silent;
      due_ = kNever;
      return;
    case Phase::idle:
    case Phase::silent:
    case Phase::failed:
      due_ = kNever;
  }
}

bool Session::next_request(std::array<std::uint8_t, 8>& request) noexcept {
  if (request_count_ == 0) return false;
  request = encode_request(requests_[0]);
  std::copy(requests_.begin() + 1, requests_.end(), requests_.begin());
  --request_count_;
  return true;
}

Instant Session::deadline() const noexcept { return due_; }

State Session::state() const noexcept {
  switch (phase_) {
    case Phase::draining:
    case Phase::awaiting:
      return State::starting;
    case Phase::streaming:
      return State::streaming;
    case Phase::silent:
      return State::silent;
    case Phase::failed:
      return State::failed;
    case Phase::idle:
      break;
  }
  return State::idle;
}

void Session::note_host_drops(std::uint64_t total) noexcept {
  if (total <= host_drops_) return;
  account_.add_host_drops(total - host_drops_, datagram_records_);
  host_drops_ = total;
}

void Session::discard(Instant arrival) {
  ++account_.counters().drained;
  if (phase_ == Phase::awaiting) return;
  if (arrival - stop_sent_ >= settings_.settle) send_stop(arrival);
  if (phase_ == Phase::draining) due_ = std::min(arrival + settings_.settle, drain_limit_);
}

bool Session::belongs_to_new_stream(const Record& first) const noexcept {
  return first.rdt_sequence <= kFirstDatagrams * static_cast<std::uint32_t>(kMaxRecords);
}

void Session::send(Command command) noexcept {
  if (request_count_ < requests_.size()) requests_[request_count_++] = command;
}

void Session::send_stop(Instant now) noexcept {
  send(Command::stop);
  stop_sent_ = now;
}

void Session::send_start(Instant now) noexcept {
  send(settings_.buffered ? Command::buffered : Command::real_time);
  const Duration patience = settings_.reply_timeout * (attempt_ == 0 ? 1 : attempt_ == 1 ? 2 : 4);
  ++attempt_;
  phase_ = Phase::awaiting;
  due_ = now + patience + 2 * settings_.datagram_period();
}

}  // namespace kphi::netbox
