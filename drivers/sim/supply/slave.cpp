#include "drivers/sim/supply/slave.hpp"

#include <algorithm>
#include <boost/crc.hpp>

#include "drivers/sim/transport/bytes.hpp"

namespace kphi::sim {
namespace {

constexpr Duration kSilence = std::chrono::milliseconds(50);
constexpr std::size_t kHeader = 7;  // of TCP: transaction, protocol, length, unit
constexpr std::size_t kLongestPdu = 253;
enum Function : std::uint8_t { kRead = 0x03, kWriteOne = 0x06, kWriteMany = 0x10 };
enum Exception : int { kIllegalFunction = 1, kIllegalAddress = 2, kIllegalValue = 3 };
constexpr std::size_t kFramesKept = 1000;
constexpr std::uint8_t kGarbage = 0x55;
constexpr int kLookBytes = 45;                             // of an answer with twenty registers
constexpr double kLongestStep = 1.0;                       // s
constexpr std::uint16_t kKeypadLock = 15;                  // a Riden's
constexpr Duration kKeysLocked = std::chrono::seconds(2);  // after a request; no source says how long

unsigned word(const std::vector<std::uint8_t>& bytes, std::size_t at) { return bytes[at] * 256u + bytes[at + 1]; }

/// Bytes of a whole RTU request that begins like this; 0: not known yet.
std::size_t rtu_length(const std::vector<std::uint8_t>& bytes) {
  if (bytes.size() < 4) return 0;
  const unsigned function = bytes[1];
  if (function >= 1 && function <= 6) return 8;
  if (function != 15 && function != 16) return bytes.size();
  return bytes.size() < 7 ? 0 : 9u + bytes[6];
}

std::vector<std::uint8_t> refuse(std::uint8_t function, int code) {
  return {static_cast<std::uint8_t>(function | 0x80u), static_cast<std::uint8_t>(code)};
}

}  // namespace

std::uint16_t modbus_crc(std::span<const std::uint8_t> bytes) noexcept {
  boost::crc_optimal<16, 0x8005, 0xFFFF, 0, true, true> crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return static_cast<std::uint16_t>(crc.checksum());
}

std::vector<std::uint8_t> modbus_frame(ModbusFraming framing, int unit, std::uint16_t transaction,
                                       std::span<const std::uint8_t> pdu) {
  std::vector<std::uint8_t> out;
  if (framing == ModbusFraming::tcp) {
    append_big(out, transaction, 2);
    append_big(out, 0, 2);
    append_big(out, static_cast<unsigned>(pdu.size() + 1), 2);
  }
  out.push_back(static_cast<std::uint8_t>(unit));
  out.insert(out.end(), pdu.begin(), pdu.end());
  if (framing == ModbusFraming::rtu) {
    const unsigned crc = modbus_crc(out);
    append_big(out, (crc & 0xFFu) << 8 | crc >> 8, 2);
  }
  return out;
}

void ModbusScanner::feed(std::span<const std::uint8_t> bytes, Instant now) {
  if (framing_ == ModbusFraming::rtu && now - last_ > kSilence) waiting_.clear();
  last_ = now;
  waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
}

std::optional<ModbusRequest> ModbusScanner::next() { return framing_ == ModbusFraming::rtu ? next_rtu() : next_tcp(); }

std::optional<ModbusRequest> ModbusScanner::next_rtu() {
  const std::size_t length = rtu_length(waiting_);
  if (length == 0 || waiting_.size() < length) return std::nullopt;
  const unsigned sent = waiting_[length - 1] * 256u + waiting_[length - 2];
  if (modbus_crc(std::span(waiting_).first(length - 2)) != sent) {
    waiting_.clear();
    return std::nullopt;
  }
  return take(length, 1, 2, 0);
}

std::optional<ModbusRequest> ModbusScanner::next_tcp() {
  if (broken_ || waiting_.size() < kHeader) return std::nullopt;
  const std::size_t length = word(waiting_, 4);
  if (word(waiting_, 2) != 0 || length < 2 || length > kLongestPdu + 1) {
    broken_ = true;
    return std::nullopt;
  }
  if (waiting_.size() < kHeader - 1 + length) return std::nullopt;
  return take(kHeader - 1 + length, kHeader, 0, word(waiting_, 0));
}

/// Takes a frame of this length off the front: its header, which ends with the unit, the PDU, a trailer.
ModbusRequest ModbusScanner::take(std::size_t length, std::size_t header, std::size_t trailer, unsigned transaction) {
  const auto frame = std::span(waiting_).first(length), pdu = frame.subspan(header, length - header - trailer);
  ModbusRequest request{frame[header - 1],
                        static_cast<std::uint16_t>(transaction),
                        {pdu.begin(), pdu.end()},
                        {frame.begin(), frame.end()}};
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(length));
  return request;
}

SupplySlave::SupplySlave(const SupplySettings& settings)
    : settings_(settings),
      circuit_(settings.circuit),
      registers_(settings.model, settings.serial, settings.over_current_in_milliamps, circuit_),
      script_(settings.faults, settings.seed) {}

double SupplySlave::advance(const SupplyLoad& load, Instant now) {
  double sag = 0;
  for (std::size_t i = 0; i < script_.size(); ++i) {
    const Fault& fault = script_[i];
    if (fault.kind == FaultKind::supply_sag && fault.active(now)) sag += fault.volts;
    const bool momentary = fault.kind == FaultKind::supply_trip || fault.kind == FaultKind::supply_panel ||
                           fault.kind == FaultKind::supply_key;
    if (!momentary || now < fault.at || !script_.unused(i)) continue;
    script_.use(i);
    if (fault.kind == FaultKind::supply_trip) circuit_.trip(static_cast<SupplyProtection>(fault.code));
    if (fault.kind == FaultKind::supply_panel) registers_.write(fault.address, fault.value);
    if (fault.kind == FaultKind::supply_key) press_output_key(now);
  }
  circuit_.sag(sag);
  if (now > reached_) circuit_.step(load, std::min(kLongestStep, to_seconds(now - reached_)));
  reached_ = std::max(reached_, now);
  return circuit_.volts();
}

void SupplySlave::receive(int client, ModbusFraming framing, std::span<const std::uint8_t> bytes, Instant now) {
  ModbusScanner& scanner = scanners_.try_emplace(client, framing).first->second;
  scanner.feed(bytes, now);
  while (const auto request = scanner.next()) answer(client, framing, *request, now);
}

bool SupplySlave::makes_sense(int client) const {
  const auto found = scanners_.find(client);
  return found == scanners_.end() || !found->second.broken();
}

void SupplySlave::forget(int client) {
  scanners_.erase(client);
  std::erase_if(under_way_, [&](const PendingReply& pending) { return pending.reply.client == client; });
}

bool SupplySlave::closed(Instant now) const noexcept {
  return script_.any_active(now, [](const Fault& fault) { return fault.kind == FaultKind::supply_closed; });
}

const Fault* SupplySlave::meet(FaultKind kind, Instant now) {
  const Fault* met = script_.strike(now, [kind](const Fault& fault) { return fault.kind == kind; });
  if (met != nullptr) ++truth_.faults;
  return met;
}

bool SupplySlave::keypad_locked(Instant now) const {
  const auto frees = [](const Fault& fault) { return fault.kind == FaultKind::supply_keys_free; };
  return registers_.model().family == SupplyModel::Family::riden && last_asked_ && now - *last_asked_ < kKeysLocked &&
         !script_.any_active(now, frees);
}

void SupplySlave::press_output_key(Instant now) {
  if (keypad_locked(now)) {
    ++truth_.dead_keys;
  } else {
    circuit_.switch_output(!circuit_.output());
  }
}

bool SupplySlave::hears(Instant now) {
  if (closed(now) || meet(FaultKind::supply_deaf, now) != nullptr) return false;
  last_asked_ = now;
  return true;
}

std::optional<Duration> SupplySlave::answers(Instant now) {
  using K = FaultKind;
  if (!hears(now)) return std::nullopt;
  for (const K spoils : {K::supply_exception, K::supply_no_reply, K::supply_wrong_slave, K::supply_wrong_transaction,
                         K::supply_bad_crc, K::supply_truncated, K::supply_garbage, K::supply_echo}) {
    if (meet(spoils, now) != nullptr) return std::nullopt;
  }
  Duration wait{0};
  if (const Fault* late = meet(K::supply_late, now)) wait += late->delay;
  if (const Fault* dribble = meet(K::supply_dribble, now)) wait += kLookBytes * dribble->delay;
  return wait;
}

void SupplySlave::answer(int client, ModbusFraming framing, const ModbusRequest& request, Instant now) {
  using K = FaultKind;
  const bool everybody = framing == ModbusFraming::rtu && request.unit == 0;
  if (framing == ModbusFraming::rtu && !everybody && request.unit != settings_.slave) return;
  ++truth_.requests;
  if (truth_.frames.size() < kFramesKept) truth_.frames.push_back(request.adu);
  if (meet(K::supply_deaf, now) != nullptr) return;
  last_asked_ = now;
  const Fault* exception = meet(K::supply_exception, now);
  const Pdu pdu = exception != nullptr ? refuse(request.pdu[0], exception->code) : apply(request.pdu, now);
  if (everybody || meet(K::supply_no_reply, now) != nullptr) return;

  const Fault* stranger = meet(K::supply_wrong_slave, now);
  const auto transaction =
      static_cast<std::uint16_t>(request.transaction + (meet(K::supply_wrong_transaction, now) != nullptr ? 1 : 0));
  auto bytes = modbus_frame(framing, stranger != nullptr ? stranger->slave : request.unit, transaction, pdu);
  if (framing == ModbusFraming::rtu && meet(K::supply_bad_crc, now) != nullptr) bytes.back() ^= 0xFFu;
  if (const Fault* cut = meet(K::supply_truncated, now)) bytes.resize(std::min<std::size_t>(bytes.size(), cut->size));
  if (const Fault* noise = meet(K::supply_garbage, now)) bytes.insert(bytes.begin(), noise->size, kGarbage);
  if (meet(K::supply_echo, now) != nullptr) bytes.insert(bytes.begin(), request.adu.begin(), request.adu.end());
  const Fault* late = meet(K::supply_late, now);
  const Fault* dribble = meet(K::supply_dribble, now);
  Instant due = std::max(now + settings_.turnaround, next_turn_);
  if (settings_.replies_per_s > 0) next_turn_ = due + from_seconds(1 / settings_.replies_per_s);
  if (late != nullptr) due += late->delay;
  send(client, std::move(bytes), due, dribble != nullptr ? dribble->delay : Duration{0});
}

/// Whole, or byte by byte; nothing overtakes.
void SupplySlave::send(int client, std::vector<std::uint8_t> bytes, Instant due, Duration gap) {
  last_due_ = std::max(last_due_, due);
  if (gap == Duration{0}) {
    under_way_.push_back({last_due_, {client, std::move(bytes)}});
    return;
  }
  for (const std::uint8_t byte : bytes) {
    under_way_.push_back({last_due_, {client, {byte}}});
    last_due_ += gap;
  }
}

bool SupplySlave::next_reply(SupplyReply& out, Instant now) {
  if (under_way_.empty() || under_way_.front().due > now) return false;
  out = std::move(under_way_.front().reply);
  under_way_.pop_front();
  return true;
}

SupplySlave::Pdu SupplySlave::apply(const Pdu& pdu, Instant now) {
  const std::uint8_t function = pdu[0];
  if (function != kRead && function != kWriteOne && function != kWriteMany) return refuse(function, kIllegalFunction);
  if (function == kWriteMany ? pdu.size() < 6 : pdu.size() != 5) return refuse(function, kIllegalValue);
  return function == kRead ? read(pdu, now) : write(pdu, now);
}

std::uint16_t SupplySlave::value_at(std::uint16_t at, std::uint16_t value, Instant now) const {
  for (const Fault& fault : script_.faults()) {
    if (fault.kind == FaultKind::supply_reads_as && fault.active(now) && fault.address == at) return fault.value;
  }
  if (registers_.model().family == SupplyModel::Family::riden && at == kKeypadLock) return keypad_locked(now) ? 1 : 0;
  return value;
}

SupplySlave::Pdu SupplySlave::read(const Pdu& pdu, Instant now) {
  const unsigned first = word(pdu, 1), count = word(pdu, 3);
  if (count < 1 || count > registers_.model().most_registers) return refuse(pdu[0], kIllegalValue);
  Pdu out{pdu[0], static_cast<std::uint8_t>(2 * count)};
  for (unsigned at = first; at < first + count; ++at) {
    const auto value = at <= 0xFFFF ? registers_.read(static_cast<std::uint16_t>(at)) : std::nullopt;
    if (!value) return refuse(pdu[0], kIllegalAddress);
    append_big(out, value_at(static_cast<std::uint16_t>(at), *value, now), 2);
  }
  return out;
}

SupplySlave::Pdu SupplySlave::write(const Pdu& pdu, Instant now) {
  const bool many = pdu[0] == kWriteMany;
  const unsigned first = word(pdu, 1), count = many ? word(pdu, 3) : 1;
  const std::size_t values = many ? 6 : 3;
  const bool sized = pdu.size() == values + std::size_t{2} * count && (!many || pdu[5] == std::size_t{2} * count);
  if (count < 1 || count > registers_.model().most_registers || !sized) return refuse(pdu[0], kIllegalValue);
  const bool heeded = many || registers_.read(static_cast<std::uint16_t>(first));
  const bool ignored = heeded && meet(FaultKind::supply_ignored_writes, now) != nullptr;
  for (unsigned i = 0; i < count; ++i) {
    const auto at = static_cast<std::uint16_t>(first + i);
    const auto value = static_cast<std::uint16_t>(word(pdu, values + std::size_t{2} * i));
    if (first + i > 0xFFFF || !registers_.read(at)) return refuse(pdu[0], kIllegalAddress);
    truth_.writes.emplace_back(at, value);
    if (!ignored && !registers_.write(at, value)) return refuse(pdu[0], kIllegalAddress);
  }
  return {pdu.begin(), pdu.begin() + 5};
}

}  // namespace kphi::sim
