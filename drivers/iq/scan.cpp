#include "drivers/iq/scan.hpp"

#include <array>

#include "drivers/iq/conversation.hpp"

namespace kphi::iq {
namespace {

constexpr int kIds = static_cast<int>(ModuleId::last) + 1;
constexpr Duration kTurn = std::chrono::milliseconds(18);  ///< one id's; a USB adapter may be 16 ms late
constexpr Duration kLastTurn = std::chrono::milliseconds(100);

}  // namespace

// Only one is asked at a time: replies share a wire. A reply that is late is still told by its id.
std::vector<Found> scan(const std::string& device, unsigned baud) {
  Conversation line(device, baud);
  line.set_baud(baud);
  line.coast(static_cast<int>(ModuleId::broadcast));
  std::array<bool, kIds> here{}, modern{};
  int legacy_id = -1;
  const auto note = [&](const Packet& packet) {
    const int id = packet.module_id();
    if (!packet.standard() || packet.access() != Access::reply || id >= kIds) return false;
    if (packet.type == static_cast<std::uint8_t>(Client::brushless_drive)) here[static_cast<std::size_t>(id)] = true;
    if (packet.type != static_cast<std::uint8_t>(Client::system_control) || packet.data().size() != 1) return false;
    if (packet.data()[0] == id) modern[static_cast<std::size_t>(id)] = true;
    if (packet.data()[0] != id && id == 0) legacy_id = packet.data()[0];
    return false;
  };
  for (int id = 0; id < kIds; ++id) {
    line.tell(get<"brushless_drive.drive_mode">(id));
    line.listen(kTurn, note);
  }
  line.listen(kLastTurn, note);
  for (int id = 0; id < kIds; ++id) {
    if (!here[static_cast<std::size_t>(id)] && id != 0) continue;
    line.tell(get<"system_control.module_id">(id));
    line.listen(kTurn, note);
  }
  std::vector<Found> found;
  for (int id = 0; id < kIds; ++id) {
    const auto i = static_cast<std::size_t>(id);
    if (here[i]) found.push_back({id, !modern[i] && id == legacy_id});
  }
  return found;
}

}  // namespace kphi::iq
