#include "drivers/netbox/stream/session.hpp"

#include <algorithm>

namespace kphi::netbox {
namespace {

// If the stop was lost, datagrams keep arriving: start anyway after this many settle times.
constexpr int kDrainLimit = 20;
// A new stream counts from 1. A record further on than this many datagrams, plus this many times the rate since the
// start was sent, belongs to the stream before.
constexpr double kFirstDatagrams = 4, kLargestRate = 4;

std::size_t window_records(const StreamSettings& settings) {
  return std::max(settings.reorder_records, static_cast<std::size_t>(4 * settings.records_per_datagram));
}

}  // namespace

Session::Session(const StreamSettings& settings)
    : settings_(settings),
      account_(settings.divisor, settings.device_rate_hz),
      window_(window_records(settings), settings.reorder_patience, settings.divisor),
      datagram_records_(static_cast<std::size_t>(settings.records_per_datagram)) {}

void Session::adopt(const StreamSettings& settings) {
  account_.change_stride(settings.divisor, settings.device_rate_hz);
  settings_ = settings;
  window_ = ReorderWindow(window_records(settings), settings.reorder_patience, settings.divisor);
  datagram_records_ = static_cast<std::size_t>(settings.records_per_datagram);
  trouble_ = 0;
}

void Session::start(Instant now) {
  if (phase_ == Phase::idle || phase_ == Phase::failed) {
    account_.begin_segment();
    window_.forget();
    resuming_ = false;
  } else if (phase_ == Phase::streaming || phase_ == Phase::silent) {
    resuming_ = true;
    silence_told_ = phase_ == Phase::silent;
  }
  attempt_ = 0;
  requests_.clear();
  send_stop(now);
  phase_ = Phase::draining;
  bias_due_ = kNever;
  due_ = now + settings_.settle;
  drain_limit_ = now + kDrainLimit * settings_.settle;
}

void Session::stop(Instant now) {
  requests_.clear();
  send_stop(now);
  phase_ = Phase::idle;
  due_ = bias_due_ = kNever;
}

bool Session::receive_in_order(std::span<const std::uint8_t> datagram, Instant arrival, std::span<LoadCellRecord> out) {
  if (phase_ != Phase::streaming || out.empty()) return false;
  decode(datagram, out, arrival);
  if (!window_.accept_run(out, account_)) return false;
  ++account_.counters().datagrams;
  datagram_records_ = out.size();
  note_status(out);
  newest_arrival_ = arrival;
  due_ = arrival + settings_.silence();
  return true;
}

void Session::receive(std::span<const std::uint8_t> datagram, Instant arrival, std::vector<LoadCellRecord>& out) {
  Counters& counters = account_.counters();
  ++counters.datagrams;
  const std::size_t count = records_in(datagram.size());
  if (count == 0) {
    ++counters.malformed;
    return;
  }
  const std::span<LoadCellRecord> records = std::span(decoded_).first(count);
  decode(datagram, records, arrival);
  if (phase_ != Phase::streaming) {
    const bool expected = phase_ == Phase::silent || (phase_ == Phase::awaiting && belongs_to_new_stream(records[0]));
    if (!expected) return discard(arrival);
  }
  datagram_records_ = count;
  bool any_new = false;
  for (const LoadCellRecord& record : records) any_new |= window_.receive(record, account_, out);
  note_status(records);
  if (!any_new) return;
  if (phase_ != Phase::streaming) begin_streaming();
  newest_arrival_ = arrival;
  due_ = arrival + settings_.silence();
}

void Session::begin_streaming() noexcept {
  if (phase_ == Phase::silent) note_event(EventKind::resumed, decoded_[0]);
  if (resuming_ && phase_ == Phase::awaiting) {
    ++account_.counters().reconnects;
    note_event(EventKind::reconnected, decoded_[0]);
  }
  phase_ = Phase::streaming;
  resuming_ = false;
}

Command Session::start_command() const noexcept {
  return settings_.product == Product::axia ? Command::axia_multi_block : Command::buffered;
}

void Session::note_status(std::span<const LoadCellRecord> records) noexcept {
  std::uint32_t trouble = 0;
  for (const LoadCellRecord& record : records) trouble |= record.status;
  trouble &= settings_.product == Product::net_box ? kStreamTrouble : 0;
  if ((trouble & ~trouble_) != 0) note_event(EventKind::box_trouble, records.front(), trouble);
  trouble_ = trouble;
}

void Session::note_silence(Instant now) noexcept {
  LoadCellRecord last;
  last.rdt_sequence = account_.last_rdt();
  last.ft_sequence = account_.last_ft();
  last.arrival_ns = now.count();
  note_event(EventKind::silent, last);
}

void Session::note_event(EventKind kind, const LoadCellRecord& shown_by, std::uint32_t status) noexcept {
  account_.events().push_back({kind, shown_by.arrival(), shown_by.rdt_sequence, shown_by.ft_sequence,
                               account_.last_rdt(), account_.last_ft(), 0, status});
}

void Session::set_bias(Instant now) {
  if (phase_ != Phase::streaming) return;
  send(Command::set_bias);
  bias_starts_ = 0;
  bias_due_ = now + 3 * settings_.datagram_period() + settings_.bias_patience;
  bias_watched_until_ = now + settings_.silence();
}

void Session::check_bias(Instant now) noexcept {
  const bool flows = newest_arrival_ + 2 * settings_.datagram_period() + settings_.bias_patience / 2 > now;
  if (flows ? now >= bias_watched_until_ : bias_starts_ == settings_.attempts) {
    bias_due_ = kNever;
    return;
  }
  // The request may still be on its way, or the box busy.
  if (flows) {
    bias_due_ = newest_arrival_ + 3 * settings_.datagram_period() + settings_.bias_patience;
    return;
  }
  send(start_command());
  ++bias_starts_;
  bias_due_ = now + 3 * settings_.datagram_period() + settings_.reply_timeout;
}

void Session::advance(Instant now) {
  if (now >= bias_due_) check_bias(now);
  if (now < due_) return;
  switch (phase_) {
    case Phase::draining:
      return send_start(now);
    case Phase::awaiting:
      if (attempt_ < settings_.attempts) return send_start(now);
      stop(now);
      phase_ = resuming_ ? Phase::silent : Phase::failed;
      if (resuming_ && !silence_told_) note_silence(now);
      return;
    case Phase::streaming:
      phase_ = Phase::silent;
      due_ = kNever;
      note_silence(now);
      return;
    case Phase::idle:
    case Phase::silent:
    case Phase::failed:
      due_ = kNever;
  }
}

bool Session::next_request(std::array<std::uint8_t, 8>& request) noexcept {
  if (requests_.empty()) return false;
  request = encode_request(requests_.front());
  requests_.erase(requests_.begin());
  return true;
}

Instant Session::deadline() const noexcept { return std::min(due_, bias_due_); }

State Session::state() const noexcept {
  constexpr State kStates[] = {State::idle,      State::starting, State::starting,
                               State::streaming, State::silent,   State::failed};  // by Phase
  return kStates[static_cast<std::size_t>(phase_)];
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

bool Session::belongs_to_new_stream(const LoadCellRecord& first) const noexcept {
  const double datagrams = to_seconds(first.arrival() - first_start_) / to_seconds(settings_.datagram_period());
  return first.rdt_sequence <=
         settings_.records_per_datagram * (kFirstDatagrams + kLargestRate * std::max(datagrams, 0.0));
}

void Session::send(Command command) noexcept {
  if (requests_.size() < requests_.capacity()) requests_.push_back(command);
}

void Session::send_stop(Instant now) noexcept {
  send(Command::stop);
  stop_sent_ = now;
}

void Session::send_start(Instant now) noexcept {
  send(start_command());
  if (attempt_ == 0) first_start_ = now;
  const Duration patience = settings_.reply_timeout * (attempt_ == 0 ? 1 : attempt_ == 1 ? 2 : 4);
  ++attempt_;
  phase_ = Phase::awaiting;
  due_ = now + patience + 2 * settings_.datagram_period();
}

}  // namespace kphi::netbox
