#include "test/drivers/sim_equipment/usbtmc.hpp"

#include <algorithm>

#include "drivers/sim/transport/bytes.hpp"

namespace kphi::sim {
namespace {

constexpr std::uint8_t kOut = 0x01, kIn = 0x82, kNotices = 0x83;
constexpr std::size_t kHead = 12, kLongestMessage = 65536;
constexpr std::uint8_t kMessage = 1, kRequest = 2;  // MsgID, table 2
constexpr std::uint8_t kSuccess = 0x01, kPending = 0x02, kFailed = 0x80, kNotUnderWay = 0x81;
constexpr std::uint8_t kRemoteLocal = 0x02, kKnowsScpi = 0x08;

UsbShape shape_of(const UsbtmcType& type) {
  return {type.vendor, type.product,
          "kphi",      "simulated instrument",
          type.serial, {{0xFE, 0x03, 0x01, {{kOut, 2, 512}, {kIn, 2, 512}, {kNotices, 3, 2}}}}};
}

UsbAnswer bytes(std::vector<std::uint8_t> all, const UsbSetup& setup) {
  if (all.size() > setup.length) all.resize(setup.length);
  return {UsbAnswer::Kind::bytes, std::move(all)};
}

/// Tables 1 and 3: tag and its complement, nothing in the reserved byte.
bool is_header(std::span<const std::uint8_t> b) noexcept {
  return b.size() >= kHead && b[1] != 0 && (b[1] ^ b[2]) == 0xFF && b[3] == 0 && (b[0] == kMessage || b[0] == kRequest);
}

}  // namespace

Usbtmc::Usbtmc(ScpiInstrument& instrument, UsbFaults& faults, UsbtmcType type)
    : type_(std::move(type)), shape_(shape_of(type_)), instrument_(instrument), faults_(faults) {}

UsbtmcTruth Usbtmc::truth() const {
  const std::lock_guard lock(mutex_);
  return truth_;
}

UsbAnswer Usbtmc::control(const UsbSetup& setup, std::span<const std::uint8_t>) {
  const std::lock_guard lock(mutex_);
  const bool of_interface = setup.request_type == 0xA1, of_endpoint = setup.request_type == 0xA2;
  if (of_endpoint && setup.request == 1) return bytes(initiate_abort(setup, false).bytes, setup);
  if (of_endpoint && setup.request == 3) return bytes(initiate_abort(setup, true).bytes, setup);
  if (of_endpoint && (setup.request == 2 || setup.request == 4)) return bytes(check_abort().bytes, setup);
  if (of_interface && setup.request == 5) return bytes(initiate_clear().bytes, setup);
  if (of_interface && setup.request == 6) return bytes(check_clear().bytes, setup);
  if (of_interface && setup.request == 7) return bytes(capabilities().bytes, setup);
  if (of_interface && setup.request == 160) return take_remote(setup);
  return {UsbAnswer::Kind::stall, {}};
}

UsbAnswer Usbtmc::capabilities() const {
  std::vector<std::uint8_t> all(24, 0);
  all[0] = kSuccess;
  all[3] = 0x01;   // bcdUSBTMC 1.00
  all[4] = 0x04;   // indicator pulse
  all[13] = 0x01;  // bcdUSB488 1.00
  all[15] = static_cast<std::uint8_t>(kKnowsScpi | (type_.remote_local ? kRemoteLocal : 0));
  return {UsbAnswer::Kind::bytes, all};
}

UsbAnswer Usbtmc::take_remote(const UsbSetup& setup) {
  if (!type_.remote_local) return {UsbAnswer::Kind::stall, {}};
  if ((setup.value & 0xFF) != 0) {
    ++truth_.remote;
    choked_ = type_.chokes_on_remote;
  }
  return bytes({kSuccess}, setup);
}

/// 4.2.1.2 and 4.2.1.4.
UsbAnswer Usbtmc::initiate_abort(const UsbSetup& setup, bool in) {
  ++truth_.aborts;
  const std::uint8_t current = in ? last_in_tag_ : last_out_tag_;
  const bool under_way = in ? asked_ || !packets_.empty() : !message_.empty();
  if (!under_way) return {UsbAnswer::Kind::bytes, {kFailed, current}};
  if ((setup.value & 0xFF) != current) return {UsbAnswer::Kind::bytes, {kNotUnderWay, current}};
  if (in) drop_answers();
  if (!in) message_.clear();
  still_pending_ = 1;
  return {UsbAnswer::Kind::bytes, {kSuccess, current}};
}

UsbAnswer Usbtmc::check_abort() {
  const std::uint8_t status = still_pending_-- > 0 ? kPending : kSuccess;
  return {UsbAnswer::Kind::bytes, {status, 0, 0, 0, 0, 0, 0, 0}};
}

/// 4.2.1.6: both buffers are emptied, and Bulk-OUT halts until the host clears it.
UsbAnswer Usbtmc::initiate_clear() {
  ++truth_.clears;
  drop_answers();
  message_.clear();
  answer_.clear();
  out_halted_ = true;
  still_pending_ = 1;
  return {UsbAnswer::Kind::bytes, {kSuccess}};
}

UsbAnswer Usbtmc::check_clear() {
  const std::uint8_t status = still_pending_-- > 0 ? kPending : kSuccess;
  return {UsbAnswer::Kind::bytes, {status, 0}};
}

void Usbtmc::drop_answers() {
  asked_ = false;
  if (faults_.strikes(FaultKind::usb_deaf_to_abort)) return;
  packets_.clear();
}

UsbAnswer Usbtmc::out(std::uint8_t endpoint, std::span<const std::uint8_t> b) {
  const std::lock_guard lock(mutex_);
  if (endpoint != kOut || out_halted_) return {UsbAnswer::Kind::stall, {}};
  const bool taken = is_header(b) && (b[0] == kMessage ? take_message(b) : b.size() == kHead);
  if (!taken) {
    ++truth_.malformed;
    message_.clear();
    out_halted_ = true;
    return {UsbAnswer::Kind::stall, {}};
  }
  if (b[0] == kRequest) answer_request(b[1], little(b.subspan(4, 4)));
  return {};
}

/// 3.2.1.1. False: it is none.
bool Usbtmc::take_message(std::span<const std::uint8_t> b) {
  const std::size_t size = little(b.subspan(4, 4));
  const std::size_t padded = (kHead + size + 3) / 4 * 4;
  if (size == 0 || size > kLongestMessage || b.size() != padded || message_.size() + size > kLongestMessage)
    return false;
  ++truth_.messages;
  last_out_tag_ = b[1];
  message_.append(b.begin() + kHead, b.begin() + static_cast<std::ptrdiff_t>(kHead + size));
  if ((b[8] & 1) == 0) return true;
  while (!message_.empty() && (message_.back() == '\n' || message_.back() == '\r')) message_.pop_back();
  if (!answer_.empty()) {
    ++truth_.interrupted;
    instrument_.note_error(-410, "Query INTERRUPTED");
    answer_.clear();
  }
  answer_ = instrument_.apply(message_);
  if (!answer_.empty()) answer_ += '\n';
  message_.clear();
  return true;
}

/// 3.3.1.1: what is asked for, at most so many bytes of it.
void Usbtmc::answer_request(std::uint8_t tag, std::size_t at_most) {
  ++truth_.requests;
  last_in_tag_ = tag;
  asked_ = true;
  if (answer_.empty() || at_most == 0) return;
  const auto part = faults_.strikes(FaultKind::usb_parts);
  const std::size_t count = std::min({answer_.size(), at_most, part ? part->size : answer_.size()});
  const bool end = count == answer_.size();
  if (faults_.strikes(FaultKind::usb_wrong_tag)) tag = tag == 1 ? 255 : static_cast<std::uint8_t>(tag - 1);
  std::vector<std::uint8_t> all(kHead, 0);
  all[0] = kRequest;
  all[1] = tag;
  all[2] = static_cast<std::uint8_t>(~tag);
  put_little(all.data() + 4, static_cast<std::uint32_t>(count), 4);
  all[8] = end ? 1 : 0;
  all.insert(all.end(), answer_.begin(), answer_.begin() + static_cast<std::ptrdiff_t>(count));
  all.resize((all.size() + 3) / 4 * 4, 0);
  answer_.erase(0, count);
  if (choked_ || faults_.strikes(FaultKind::ambient_no_reply)) return;
  if (faults_.strikes(FaultKind::ambient_stall)) in_halted_ = true;
  const auto late = faults_.strikes(FaultKind::ambient_late);
  const Instant due = faults_.now() + (late ? late->delay : Duration{0});
  if (faults_.strikes(FaultKind::usb_empty_first)) packets_.push_back({{}, due});
  const auto small = faults_.strikes(FaultKind::usb_packets);
  const std::size_t packet = small ? small->size : all.size();
  for (std::size_t at = 0; at < all.size(); at += packet) {
    const auto from = all.begin() + static_cast<std::ptrdiff_t>(at);
    packets_.push_back({{from, from + static_cast<std::ptrdiff_t>(std::min(packet, all.size() - at))}, due});
  }
}

UsbAnswer Usbtmc::in(std::uint8_t endpoint, std::size_t at_most) {
  const std::lock_guard lock(mutex_);
  if (endpoint != kIn) return {UsbAnswer::Kind::nothing_yet, {}};
  if (in_halted_) return {UsbAnswer::Kind::stall, {}};
  if (packets_.empty() || packets_.front().due > faults_.now()) return {UsbAnswer::Kind::nothing_yet, {}};
  Packet packet = std::move(packets_.front());
  packets_.pop_front();
  if (packet.bytes.size() > at_most) {
    packets_.push_front(
        {{packet.bytes.begin() + static_cast<std::ptrdiff_t>(at_most), packet.bytes.end()}, packet.due});
    packet.bytes.resize(at_most);
  }
  if (packets_.empty()) asked_ = false;
  return {UsbAnswer::Kind::bytes, std::move(packet.bytes)};
}

void Usbtmc::halt_cleared(std::uint8_t endpoint) {
  const std::lock_guard lock(mutex_);
  (endpoint == kIn ? in_halted_ : out_halted_) = false;
}

}  // namespace kphi::sim
