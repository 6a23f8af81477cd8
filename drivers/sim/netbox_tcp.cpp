// The box's third way out: TCP 49151, commands of 20 bytes, 16 bits per axis (manual, TCP interface).
#include <algorithm>
#include <cmath>

#include "drivers/sim/bytes.hpp"
#include "drivers/sim/netbox_device.hpp"
#include "drivers/sim/netbox_units.hpp"

namespace kphi::sim {
namespace {

constexpr std::size_t kCommandBytes = 20;
constexpr std::uint32_t kHeader = 0x1234;
constexpr double kFullScale = 32767;

enum Command : std::uint8_t { kReadForces = 0, kReadCalibration = 1 };

void append16(std::string& out, std::uint32_t value) {
  out += static_cast<char>(value >> 8 & 0xff);
  out += static_cast<char>(value & 0xff);
}
void append32(std::string& out, std::uint32_t value) {
  append16(out, value >> 16);
  append16(out, value & 0xffff);
}

/// Counts per TCP count: the full range fills 16 bits.
std::int32_t scale_factor(const NetBoxDevice& box, std::size_t axis) {
  const double counts = box.settings().range[axis] * box.signal().counts_per_si(axis);
  return static_cast<std::int32_t>(std::clamp(std::round(counts / kFullScale), 1.0, 65535.0));
}

}  // namespace

std::string NetBoxDevice::tcp(std::string& received, bool& close) {
  std::string answers;
  while (received.size() >= kCommandBytes && !close) {
    std::array<std::uint8_t, kCommandBytes> command{};
    std::copy_n(received.begin(), kCommandBytes, command.begin());
    received.erase(0, kCommandBytes);
    answer_tcp(command, answers, close);
  }
  return answers;
}

void NetBoxDevice::answer_tcp(std::span<const std::uint8_t> command, std::string& out, bool& close) {
  if (command[0] == kReadForces) {
    const std::uint32_t enabled = big(command.subspan(16, 2));
    const std::uint32_t orders = big(command.subspan(18, 2));
    if (settings_.habits.readft_sets_conditions) {
      for (std::size_t i = 0; i < settings_.conditions.size(); ++i)
        settings_.conditions[i].enabled = (enabled >> i & 1u) != 0;
      signal_.configure(settings_);
    }
    if ((orders & 1u) != 0) bias();
    if ((orders & 2u) != 0) signal_.reset_latch();
    append16(out, kHeader);
    append16(out, status_ >> 16);
    for (std::size_t axis = 0; axis < 6; ++axis) {
      const double coarse = std::round(static_cast<double>(signal_.counts()[axis]) / scale_factor(*this, axis));
      append16(out, static_cast<std::uint32_t>(static_cast<std::int32_t>(std::clamp(coarse, -32768.0, 32767.0))));
    }
  } else if (command[0] == kReadCalibration) {
    const Slot& slot = settings_.slots[static_cast<std::size_t>(settings_.active_slot)];
    append16(out, kHeader);
    out += static_cast<char>(slot.force_unit);
    out += static_cast<char>(slot.torque_unit);
    append32(out, static_cast<std::uint32_t>(counts_per_force(settings_, settings_.active_slot)));
    append32(out, static_cast<std::uint32_t>(counts_per_torque(settings_, settings_.active_slot)));
    for (std::size_t axis = 0; axis < 6; ++axis) append16(out, static_cast<std::uint32_t>(scale_factor(*this, axis)));
  } else {
    close = settings_.habits.close_on_unknown_tcp;
  }
}

}  // namespace kphi::sim
