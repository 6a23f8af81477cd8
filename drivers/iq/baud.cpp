#include "drivers/iq/baud.hpp"

#include <fmt/format.h>

#include <thread>

#include "drivers/iq/conversation.hpp"

namespace kphi::iq {
namespace {

constexpr const Entry& kBaudRate = entry<"serial_interface.baud_rate">;
constexpr const Entry& kDriveMode = entry<"brushless_drive.drive_mode">;
constexpr Duration kReply = std::chrono::milliseconds(60);
constexpr Duration kBoot = std::chrono::seconds(2);
constexpr int kTrial = 100;

/// Several questions, as the first may be swallowed by what the module takes for the end of a frame.
bool answers(Conversation& module, int module_id, Duration for_so_long = kReply) {
  const auto end = std::chrono::steady_clock::now() + for_so_long;
  int asked = 0;
  do {
    if (module.ask(kDriveMode, module_id, kReply)) return true;
  } while (++asked < 2 || std::chrono::steady_clock::now() < end);
  return false;
}

bool answers_at(Conversation& module, int module_id, unsigned baud, Duration for_so_long = kReply) {
  module.set_baud(baud);
  module.coast(module_id);
  return answers(module, module_id, for_so_long);
}

std::optional<unsigned> search(Conversation& module, int module_id, unsigned first) {
  if (answers_at(module, module_id, first)) return first;
  for (const unsigned baud : bauds_to_try()) {
    if (baud != first && answers_at(module, module_id, baud)) return baud;
  }
  return std::nullopt;
}

/// Where system_control answers: on old firmware at id 0, whatever the module's own is.
int system_control_id(Conversation& module, int module_id) {
  constexpr const Entry& own_id = entry<"system_control.module_id">;
  if (module_id == 0 || module.ask(own_id, module_id, kReply)) return module_id;
  return module.ask(own_id, 0, kReply) == module_id ? 0 : module_id;
}

/// The rate is set; whether and how the module has taken it over.
std::optional<BaudChange::Effect> follow(Conversation& module, int module_id, unsigned from, unsigned to) {
  if (answers_at(module, module_id, to)) return BaudChange::Effect::at_once;
  if (!answers_at(module, module_id, from)) return std::nullopt;
  const int id = system_control_id(module, module_id);
  module.tell(set<"system_control.reboot_program">(id));
  if (answers_at(module, module_id, to, kBoot)) return BaudChange::Effect::after_reboot;
  return std::nullopt;
}

/// Leaves the module speaking at `baud`, from wherever it is; false when it is nowhere. On an unreliable line more than
/// one command may get lost.
bool bring_to(Conversation& module, int module_id, unsigned baud) {
  for (int attempt = 0; attempt < 3; ++attempt) {
    const auto found = search(module, module_id, baud);
    if (found == baud) return true;
    if (!found) continue;
    module.tell(make(kBaudRate, Access::set, module_id, baud));
    if (follow(module, module_id, *found, baud)) return true;
  }
  return false;
}

int count_answers(Conversation& module, int module_id) {
  int answered = 0;
  for (int i = 0; i < kTrial; ++i) answered += module.ask(kDriveMode, module_id, kReply) ? 1 : 0;
  return answered;
}

[[noreturn]] void refuse(const std::string& device, unsigned to, const std::string& cause, const char* next_move) {
  throw DeviceError("motor module on " + device, fmt::format("change to {} baud", to), cause, next_move);
}

}  // namespace

const std::vector<unsigned>& bauds_to_try() {
  static const std::vector<unsigned> bauds{115200, 921600, 1000000, 2000000, 460800, 230400, 57600, 38400, 19200, 9600};
  return bauds;
}

std::string BaudChange::summary() const {
  constexpr const char* effects[] = {"at once", "after a reboot", "again: the new rate was not reliable"};
  return fmt::format("speaks at {} baud {}, {} of {} questions were answered at the new rate", to,
                     effects[static_cast<int>(effect)], answered, asked);
}

std::optional<unsigned> find_baud(const std::string& device, int module_id, unsigned first) {
  Conversation module(device, first);
  return search(module, module_id, first);
}

BaudChange change_baud(const std::string& device, int module_id, unsigned from, unsigned to) {
  if (!serial::known_baud(to)) refuse(device, to, "this system does not know that rate", "choose another");
  Conversation module(device, from);
  if (!module.coast_and_confirm(module_id)) {
    refuse(device, to, fmt::format("it does not confirm at {} baud that it coasts", from), "find its rate first");
  }
  BaudChange change{from, to};
  if (from == to) return change;
  module.tell(make(kBaudRate, Access::set, module_id, to));
  const auto effect = follow(module, module_id, from, to);
  if (effect) {
    change.effect = *effect;
    change.asked = kTrial;
    change.answered = count_answers(module, module_id);
    if (change.answered == kTrial) return change;
  }
  if (!bring_to(module, module_id, from)) refuse(device, to, "it answers at no rate any more", "power it off and on");
  change.to = from;
  change.effect = BaudChange::Effect::rolled_back;
  return change;
}

}  // namespace kphi::iq
