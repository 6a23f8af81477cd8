#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "base/error.hpp"
#include "drivers/scpi/line.hpp"
#include "drivers/scpi/wire.hpp"

namespace kphi::scpi {
namespace {

using namespace std::chrono_literals;

constexpr std::uint8_t kClass = 0xFE, kSubclass = 0x03;
constexpr std::uint8_t kFromInterface = 0xA1, kFromEndpoint = 0xA2;
enum Request : std::uint8_t {
  initiate_abort_out = 1,  // one more: check it
  initiate_abort_in = 3,
  initiate_clear = 5,
  check_clear = 6,
  get_capabilities = 7,
  ren_control = 160,
};
constexpr std::uint8_t kSuccess = 0x01, kPending = 0x02;
constexpr int kChecks = 100;  // of a clear or abort that is pending
constexpr usb::Transport::Timeout kControlTimeout = 500ms, kDrainTimeout = 20ms;
// A host must have room for complete packets, of 64, 512 or 1024 bytes: header and data fill four of the largest.
constexpr std::size_t kRoom = 4096;
constexpr std::uint32_t kPart = kRoom - usbtmc::kHeaderBytes;  // bytes asked for at once

/// They claim remote/local but hang on REN.
struct Choker {
  std::uint16_t vendor, product;  // product 0: all of the vendor's
};
constexpr Choker kChokeOnRemoteControl[] = {{0x1ab1, 0x0588}, {0x1ab1, 0x04b0}, {0x1ab1, 0x04b1},
                                            {0x1ab1, 0x0515}, {0xf4ec, 0},      {0x0b21, 0}};

bool chokes(const usb::Transport& device) noexcept {
  return std::ranges::any_of(kChokeOnRemoteControl, [&](const Choker& c) {
    return c.vendor == device.vendor() && (c.product == 0 || c.product == device.product());
  });
}

}  // namespace

Usbtmc::Usbtmc(usb::Transport& transport, Timeout timeout) : transport_(transport), timeout_(timeout) {
  find_endpoints();
  transport_.claim(interface_);
  read_capabilities();
  clear();
  take_remote_control();
}

std::optional<LastWord> Usbtmc::last_word(std::string_view command, std::string_view, const std::string& device) const {
  const std::string file = transport_.device_file();
  if (file.empty()) return std::nullopt;
  const auto message = usbtmc::message_out(1, std::string(command) + "\n");
  return LastWord{device, LastWord::Wire::usb, file, interface_ + 256u * out_.address,
                  std::string(message.begin(), message.end())};
}

void Usbtmc::find_endpoints() {
  for (const usb::Interface& candidate : transport_.interfaces()) {
    if (candidate.class_code != kClass || candidate.subclass != kSubclass) continue;
    for (const usb::Endpoint& endpoint : candidate.endpoints) {
      if (endpoint.kind == usb::EndpointKind::bulk) (endpoint.in() ? in_ : out_) = endpoint;
    }
    interface_ = candidate.number;
    if (in_.address != 0 && out_.address != 0) return;
  }
  fail("open", "it has no USBTMC interface", "check that this is a SCPI instrument");
}

void Usbtmc::read_capabilities() {
  std::array<std::uint8_t, 24> answer{};
  const usb::Transfer got =
      transport_.control_in({kFromInterface, get_capabilities, 0, interface_}, answer, kControlTimeout);
  if (got.outcome != usb::Outcome::done || got.bytes != answer.size() || answer[0] != kSuccess) return;
  remote_local_ = (answer[15] & 2) != 0;
}

void Usbtmc::take_remote_control() {
  if (!remote_local_ || chokes(transport_)) return;
  std::array<std::uint8_t, 1> answer{};
  // Instruments obey without it, too; only their front panel stays unlocked.
  (void)transport_.control_in({kFromInterface, ren_control, 1, interface_}, answer, kControlTimeout);
}

void Usbtmc::clear() {
  std::array<std::uint8_t, 2> answer{};
  const auto request = [&](Request what, std::size_t bytes) {
    const usb::Transfer got =
        transport_.control_in({kFromInterface, what, 0, interface_}, std::span(answer).first(bytes), kControlTimeout);
    if (got.outcome != usb::Outcome::done) fail("clear", usb::name_of(got.outcome), "plug the instrument in again");
    return answer[0];
  };
  std::uint8_t status = request(initiate_clear, 1);
  if (status == kSuccess) status = request(check_clear, 2);
  for (int i = 0; status == kPending && i < kChecks; ++i) {
    if ((answer[1] & 1) != 0) drain();
    status = request(check_clear, 2);
  }
  if (status != kSuccess) fail("clear", fmt::format("status 0x{:02X}", status), "switch the instrument off and on");
  (void)transport_.clear_halt(out_);
  out_of_order_ = false;
}

void Usbtmc::write(std::string_view command) {
  if (out_of_order_) clear();
  tag_ = usbtmc::next_tag(tag_);
  const auto message = usbtmc::message_out(tag_, std::string(command) + "\n");
  const usb::Transfer sent = transport_.write(out_, message, timeout_);
  if (sent.outcome == usb::Outcome::done && sent.bytes == message.size()) return;
  recover_and_fail(out_, sent.outcome, command, usb::name_of(sent.outcome));
}

std::string Usbtmc::query(std::string_view command) {
  write(command);
  std::string answer;
  bool first = true;
  while (!receive_part(answer, first)) {
    first = false;
    if (answer.size() <= kLongestAnswer) continue;
    out_of_order_ = true;
    fail(command, "the answer does not end");
  }
  while (!answer.empty() && (answer.back() == '\n' || answer.back() == '\r')) answer.pop_back();
  return answer;
}

/// True once the message has ended. Some instruments send one empty packet before the first answer.
bool Usbtmc::receive_part(std::string& answer, bool may_be_empty) {
  tag_ = usbtmc::next_tag(tag_);
  const auto request = usbtmc::request_in(tag_, kPart);
  const usb::Transfer asked = transport_.write(out_, request, timeout_);
  if (asked.outcome != usb::Outcome::done)
    recover_and_fail(out_, asked.outcome, "ask for the answer", usb::name_of(asked.outcome));
  std::array<std::uint8_t, kRoom> buffer;
  usb::Transfer got = transport_.read(in_, buffer, timeout_);
  if (got.outcome == usb::Outcome::done && got.bytes == 0 && may_be_empty) got = transport_.read(in_, buffer, timeout_);
  if (got.outcome != usb::Outcome::done)
    recover_and_fail(in_, got.outcome, "read the answer", usb::name_of(got.outcome),
                     "check that the instrument knows this command");
  const auto header = usbtmc::answer_header(std::span(buffer).first(got.bytes), tag_);
  const bool goes_nowhere = header && header->bytes == 0 && !header->end_of_message;
  if (!header || header->bytes > kPart || goes_nowhere)
    recover_and_fail(in_, got.outcome, "read the answer",
                     goes_nowhere ? "the answer is empty and does not end" : "the reply belongs to another request");
  std::size_t have = std::min<std::size_t>(got.bytes - usbtmc::kHeaderBytes, header->bytes);
  answer.append(reinterpret_cast<const char*>(buffer.data()) + usbtmc::kHeaderBytes, have);
  while (have < header->bytes) {
    got = transport_.read(in_, buffer, timeout_);
    if (got.outcome != usb::Outcome::done || got.bytes == 0)
      recover_and_fail(in_, got.outcome, "read the answer",
                       got.bytes == 0 ? "the answer breaks off" : usb::name_of(got.outcome));
    const std::size_t more = std::min<std::size_t>(got.bytes, header->bytes - have);
    answer.append(reinterpret_cast<const char*>(buffer.data()), more);
    have += more;
  }
  return header->end_of_message;
}

void Usbtmc::recover_and_fail(const usb::Endpoint& endpoint, usb::Outcome outcome, std::string_view operation,
                              const std::string& cause, const char* next_move) {
  const bool gone = outcome == usb::Outcome::gone;
  out_of_order_ = true;
  if (!gone && (outcome == usb::Outcome::timed_out || endpoint.in())) abort(endpoint);
  if (!gone) (void)transport_.clear_halt(endpoint);
  fail(operation, cause, next_move);
}

void Usbtmc::abort(const usb::Endpoint& endpoint) noexcept {
  const std::uint8_t initiate = endpoint.in() ? initiate_abort_in : initiate_abort_out;
  std::array<std::uint8_t, 8> answer{};
  usb::Transfer got = transport_.control_in({kFromEndpoint, initiate, tag_, endpoint.address},
                                            std::span(answer).first(2), kControlTimeout);
  if (got.outcome != usb::Outcome::done || answer[0] != kSuccess) return;
  const auto check = static_cast<std::uint8_t>(initiate + 1);
  for (int i = 0; i < kChecks; ++i) {
    if (endpoint.in()) drain();
    got = transport_.control_in({kFromEndpoint, check, 0, endpoint.address}, answer, kControlTimeout);
    if (got.outcome != usb::Outcome::done || answer[0] != kPending) return;
  }
}

void Usbtmc::drain() noexcept {
  std::array<std::uint8_t, kRoom> discarded;
  for (int i = 0; i < kChecks; ++i) {
    const usb::Transfer got = transport_.read(in_, discarded, kDrainTimeout);
    if (got.outcome != usb::Outcome::done || got.bytes < discarded.size()) return;
  }
}

void Usbtmc::fail(std::string_view operation, const std::string& cause, const char* next_move) {
  throw DeviceError(transport_.name(), std::string(operation), cause, next_move);
}

}  // namespace kphi::scpi
