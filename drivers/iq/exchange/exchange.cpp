#include "drivers/iq/exchange/exchange.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::iq {
namespace {

constexpr std::size_t kGetFrame = 7;

// Entries for barrier queries: every firmware has them, telemetry does not use them, and there are as many as requests
// can get lost in the longest break of the line that is not yet a failure.
constexpr const Entry* kBarriers[] = {
    &entry<"propeller_motor_control.ctrl_mode">,
    &entry<"brushless_drive.motor_pole_pairs">,
    &entry<"propeller_motor_control.velocity_Kp">,
    &entry<"brushless_drive.motor_Kv">,
    &entry<"propeller_motor_control.velocity_Ki">,
    &entry<"brushless_drive.motor_R_ohm">,
    &entry<"propeller_motor_control.velocity_Kd">,
    &entry<"brushless_drive.obs_supply_volts">,
    &entry<"propeller_motor_control.velocity_ff0">,
    &entry<"brushless_drive.drive_volts">,
    &entry<"propeller_motor_control.velocity_ff1">,
    &entry<"brushless_drive.drive_pwm">,
    &entry<"propeller_motor_control.velocity_ff2">,
    &entry<"brushless_drive.obs_angle">,
    &entry<"power_monitor.watts">,
    &entry<"power_monitor.joules">,
};

}  // namespace

double QueryResult::value() const noexcept {
  return kind == Kind::answer ? number(request.entry->format, packet.data()) : std::nan("");
}

Exchange::Exchange(const Settings& settings)
    : longest_timeout_(settings.reply_timeout),
      byte_time_(settings.wire_byte_time),
      wire_paces_(settings.wire_paces),
      credit_bytes_(settings.credit_bytes),
      requests_(settings.reply_timeout),
      timeout_(settings.reply_timeout * 2 / 5, settings.reply_timeout) {
  results_.reserve(64);
}

void Exchange::change_line() noexcept {
  parser_.reset();
  tx_queue_.clear();
  requests_.clear();
  wire_free_ = Instant{0};
}

bool Exchange::ask(const Entry& asked, int module_id, Instant now) noexcept {
  if (busy(asked, module_id) || requests_.full() || !fits(kGetFrame)) return false;
  if (!tx_queue_.push(TxQueue::Kind::request, make(asked, Access::get, module_id))) return false;
  Request request = on_wire(&asked, module_id, kGetFrame, now);
  request.alone = requests_.none_open();
  requests_.add(request);
  own_ids_ |= std::uint64_t{1} << module_id;
  ++counters_.requests;
  return true;
}

bool Exchange::tell(TxQueue::Kind kind, const Packet& packet, Instant now) noexcept {
  const std::size_t bytes = packet.length + kFrameOverhead;
  if (requests_.full() || !fits(bytes) || !tx_queue_.push(kind, packet)) return false;
  requests_.add(on_wire(nullptr, packet.module_id(), bytes, now));
  return true;
}

bool Exchange::tell_and_ask(const Entry& told, double value, int module_id, Instant now) noexcept {
  const Packet packet = make(told, Access::set, module_id, value);
  if (busy(told, module_id) || !fits(packet.length + kFrameOverhead + kGetFrame)) return false;
  return tell(TxQueue::Kind::setting, packet, now) && ask(told, module_id, now);
}

void Exchange::ask_barrier(int module_id, Instant now) noexcept {
  if (!requests_.has_expired() || !requests_.none_open()) return;
  for (std::size_t tries = 0; tries < std::size(kBarriers); ++tries) {
    const Entry& barrier = *kBarriers[barrier_];
    barrier_ = (barrier_ + 1) % std::size(kBarriers);
    if (ask(barrier, module_id, now)) return;
  }
}

void Exchange::coast(int module_id, int times, bool padded, Instant now) noexcept {
  const Packet packet = make(entry<"propeller_motor_control.ctrl_coast">, Access::set, module_id);
  for (int i = 0; i < times; ++i) {
    if (!tx_queue_.push_coast(packet, padded && i == 0)) continue;
    on_wire(nullptr, module_id, packet.length + kFrameOverhead + (padded && i == 0 ? TxQueue::kPadding : 0), now);
    ++counters_.coasts;
  }
}

bool Exchange::fits(std::size_t bytes) const noexcept { return requests_.outstanding_bytes() + bytes <= credit_bytes_; }

std::span<const QueryResult> Exchange::receive(std::span<const std::uint8_t> bytes, Instant now) {
  results_.clear();
  // In pieces, so that the arrival of every byte of the longest frame is known.
  while (!bytes.empty()) {
    const std::size_t n = std::min(bytes.size(), kMaxFrame);
    const Instant end = now - byte_time_ * static_cast<std::int64_t>(bytes.size() - n);
    stamp_arrivals(n, end, now);
    parser_.push(bytes.first(n), [&](const Packet& packet, std::uint64_t last) { take_packet(packet, last); });
    bytes = bytes.subspan(n);
  }
  last_chunk_ = now;
  static_cast<Parser::Counters&>(counters_) = parser_.counters();
  return results_;
}

std::span<const QueryResult> Exchange::advance(Instant now) {
  results_.clear();
  while (parser_.partial() && now - reading_of(parser_.partial_offset()) >= patience()) {
    ++counters_.resyncs;
    parser_.abandon([&](const Packet& packet, std::uint64_t end) { take_packet(packet, end); });
  }
  static_cast<Parser::Counters&>(counters_) = parser_.counters();
  requests_.expire(understood_until(now), [&](const Request& request) {
    ++counters_.timeouts;
    timeout_.timed_out(request.started, now);
    results_.push_back({QueryResult::Kind::timeout, request, {}, now, now, {}});
  });
  return results_;
}

Instant Exchange::deadline() const noexcept {
  const Instant earliest = requests_.deadline();
  if (!parser_.partial()) return earliest;
  const Instant since = reading_of(parser_.partial_offset());
  return earliest <= since ? earliest : since + patience();
}

void Exchange::sent(std::size_t n) noexcept {
  counters_.bytes_out += n;
  tx_queue_.sent(n);
}

void Exchange::take_packet(const Packet& packet, std::uint64_t end) {
  if (!packet.standard() || packet.access() != Access::reply) {
    ++counters_.unasked;
    return;
  }
  const std::uint64_t id = std::uint64_t{1} << packet.module_id();
  if ((id & own_ids_) == 0) {
    ++counters_.wrong_module;
    return;
  }
  const std::size_t size = packet.length + kFrameOverhead;
  const auto request = requests_.answer(packet.type, packet.sub(), packet.module_id(), begun(end - size));
  if (!request) {
    ++counters_.unasked;
    return;
  }
  if (request->expired) {
    ++counters_.late_replies;
    return;
  }
  ++counters_.replies;
  const Instant last_byte = arrival_of(end - 1);
  learn(*request, size, last_byte);
  const bool whole = packet.data().size() == size_of(request->entry->format);
  if (!whole) ++counters_.wrong_length;
  Instant from = request->started + byte_time_ * static_cast<std::int64_t>(request->bytes);
  Instant to = last_byte - byte_time_ * static_cast<std::int64_t>(size);
  // A link without real wire time (a pseudo-terminal) can answer faster than the bytes would take.
  if (to < from) {
    from = std::min(request->queued, last_byte);
    to = last_byte;
  }
  results_.push_back({whole ? QueryResult::Kind::answer : QueryResult::Kind::wrong_length, *request, packet, last_byte,
                      from + (to - from) / 2, (to - from) / 2});
}

// The bytes of a chunk arrived one after the other, before it was read and after the previous chunk was.
void Exchange::stamp_arrivals(std::size_t n, Instant end, Instant now) noexcept {
  const std::uint64_t first = parser_.counters().bytes_in;
  for (std::size_t i = 0; i < n; ++i) {
    const Instant on_wire = end - byte_time_ * static_cast<std::int64_t>(n - 1 - i);
    arrivals_[(first + i) % kArrivals] = {std::max(on_wire, last_chunk_), now};
  }
}

// A USB adapter may hand over the second half of a frame 16 ms after the first.
Duration Exchange::patience() const noexcept {
  return std::max(longest_timeout_ / 4, byte_time_ * static_cast<std::int64_t>(kMaxFrame));
}

// The bytes after a header that may be false can hold the answer: until that is known, no query is late that was not
// late when the header arrived.
Instant Exchange::understood_until(Instant now) const noexcept {
  return parser_.partial() ? std::min(now, reading_of(parser_.partial_offset())) : now;
}

void Exchange::learn(const Request& request, std::size_t reply_bytes, Instant end) noexcept {
  timeout_.measured(std::max(end - request.started, Duration{0}));
  if (!request.alone) return;
  const Duration on_wire = byte_time_ * static_cast<std::int64_t>(request.bytes + reply_bytes);
  round_trips_.add(std::max(end - request.started - on_wire, Duration{0}));
}

Request Exchange::on_wire(const Entry* asked, int module_id, std::size_t bytes, Instant now) noexcept {
  Request request;
  request.entry = asked;
  request.module_id = module_id;
  request.bytes = bytes;
  request.order = ++order_;
  request.queued = now;
  request.started = std::max(now, wire_free_);
  // Half of it, because the module's clock is not quite as fast as this host's.
  request.earliest = wire_paces_ ? request.started + byte_time_ * static_cast<std::int64_t>(bytes) / 2 : now;
  request.patience = timeout_.timeout();
  wire_free_ = request.started + byte_time_ * static_cast<std::int64_t>(bytes);
  return request;
}

}  // namespace kphi::iq
