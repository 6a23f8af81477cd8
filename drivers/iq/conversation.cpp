#include "drivers/iq/conversation.hpp"

#include <algorithm>
#include <thread>

namespace kphi::iq {
namespace {

using std::chrono::steady_clock;
constexpr Duration kWriteLimit = std::chrono::milliseconds(500);
constexpr Duration kReply = std::chrono::milliseconds(60);
constexpr Duration kAdapter = std::chrono::milliseconds(50);  ///< bytes that only an adapter knows of may still leave

Duration on_wire(std::size_t bytes, unsigned baud) { return from_seconds(10.0 * static_cast<double>(bytes) / baud); }

}  // namespace

bool is_reply_of(const Packet& packet, const Entry& asked, int module_id) noexcept {
  return packet.standard() && packet.access() == Access::reply && packet.module_id() == module_id &&
         packet.type == static_cast<std::uint8_t>(asked.type) && packet.sub() == asked.sub;
}

void Conversation::set_baud(unsigned baud) {
  port_.drain(kWriteLimit);
  std::this_thread::sleep_for(kAdapter);
  port_.set_baud(baud);
  parser_.reset();
  const std::array<std::uint8_t, kMaxFrame> zeros{};
  send(zeros);
}

bool Conversation::resynchronise() noexcept {
  const bool partial = parser_.partial();
  parser_.reset();
  return partial;
}

bool Conversation::tell(const Packet& packet) {
  std::array<std::uint8_t, kMaxFrame> frame;
  const std::size_t size = encode(packet, frame);
  return send(std::span(frame).first(size));
}

bool Conversation::send(std::span<const std::uint8_t> bytes) {
  for (const auto end = steady_clock::now() + kWriteLimit; !bytes.empty() && steady_clock::now() < end;) {
    bytes = bytes.subspan(port_.write(bytes));
    if (!bytes.empty()) port_.drain(std::chrono::milliseconds(2));
  }
  return bytes.empty();
}

std::optional<double> Conversation::ask(const Entry& asked, int module_id, Duration wall) {
  listen(Duration{0}, [](const Packet&) { return false; });  // what came too late for the question before
  tell(make(asked, Access::get, module_id));
  std::optional<double> answer;
  listen(wall + on_wire(port_.unsent() + kMaxFrame, baud()), [&](const Packet& packet) {
    if (!is_reply_of(packet, asked, module_id) || packet.data().size() != size_of(asked.format)) return false;
    answer = number(asked.format, packet.data());
    return true;
  });
  return answer;
}

void Conversation::coast(int module_id) {
  for (int i = 0; i < 3; ++i) {
    tell(set<"propeller_motor_control.ctrl_coast">(module_id));
    tell(set<"propeller_motor_control.ctrl_coast">(static_cast<int>(ModuleId::broadcast)));
  }
}

bool Conversation::coast_and_confirm(int module_id) {
  for (int attempt = 0; attempt < 5; ++attempt) {
    coast(module_id);
    const auto mode = ask(entry<"brushless_drive.drive_mode">, module_id, kReply);
    if (mode == static_cast<double>(DriveMode::coast)) return true;
  }
  return false;
}

}  // namespace kphi::iq
