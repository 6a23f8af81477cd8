#include "drivers/iq/service/search.hpp"

#include <array>

#include "drivers/iq/service/dialogue.hpp"

namespace kphi::iq {
namespace {

constexpr const Entry& kDriveMode = entry<"brushless_drive.drive_mode">;
constexpr Duration kReply = std::chrono::milliseconds(60);
constexpr int kIds = static_cast<int>(ModuleId::last) + 1;
constexpr Duration kTurn = std::chrono::milliseconds(18);  ///< for each id; a USB adapter may be 16 ms late
constexpr Duration kLastTurn = std::chrono::milliseconds(100);

/// Two queries, because the module may take the first for the end of a frame.
bool answers_at(Conversation& line, int module_id, unsigned baud) {
  line.set_baud(baud);
  line.coast(module_id);
  return line.ask(kDriveMode, module_id, kReply) || line.ask(kDriveMode, module_id, kReply);
}

}  // namespace

const std::vector<unsigned>& bauds_to_try() {
  static const std::vector<unsigned> bauds{115200, 921600, 1000000, 2000000, 460800, 230400, 57600, 38400, 19200, 9600};
  return bauds;
}

std::optional<unsigned> find_baud(const std::string& device, int module_id, unsigned first) {
  Conversation line(device, first);
  if (answers_at(line, module_id, first)) return first;
  for (const unsigned baud : bauds_to_try()) {
    if (baud != first && answers_at(line, module_id, baud)) return baud;
  }
  return std::nullopt;
}

// One id at a time, because replies share a wire. A late reply still carries its id.
std::vector<int> find_ids(const std::string& device, unsigned baud) {
  Conversation line(device, baud);
  line.set_baud(baud);
  line.coast(static_cast<int>(ModuleId::broadcast));
  std::array<bool, kIds> answered{};
  const auto note = [&](const Packet& packet) {
    const int id = packet.module_id();
    if (id < kIds && is_reply_of(packet, kDriveMode, id)) answered[static_cast<std::size_t>(id)] = true;
    return false;
  };
  for (int id = 0; id < kIds; ++id) {
    line.tell(get<"brushless_drive.drive_mode">(id));
    line.listen(id + 1 < kIds ? kTurn : kLastTurn, note);
  }
  std::vector<int> ids;
  for (int id = 0; id < kIds; ++id) {
    if (answered[static_cast<std::size_t>(id)]) ids.push_back(id);
  }
  return ids;
}

}  // namespace kphi::iq
