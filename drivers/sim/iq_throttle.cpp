#include "drivers/sim/iq_throttle.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::sim {
namespace {

constexpr std::uint8_t kParser = 60, kArming = 86;

bool within(double throttle, const IqMemory& memory, std::uint8_t upper) noexcept {
  return throttle <= memory.value(kArming, upper) &&
         throttle >= memory.value(kArming, static_cast<std::uint8_t>(upper + 1));
}

}  // namespace

IqThrottle::Event IqThrottle::command(double throttle, const IqMemory& memory) noexcept {
  arming_ = memory.value(kArming, 2) != 0 && within(throttle, memory, 3) ? arming_ + 1 : 0;
  disarming_ = memory.value(kArming, 5) != 0 && within(throttle, memory, 6) ? disarming_ + 1 : 0;
  if (!armed_ && arming_ > 0 && arming_ >= memory.value(kArming, 8)) return arm(true);
  const bool may_disarm = memory.value(kArming, 1) == 0;
  if (armed_ && may_disarm && disarming_ > 0 && disarming_ >= memory.value(kArming, 13)) return arm(false);
  return Event::none;
}

IqThrottle::Event IqThrottle::arm(bool armed) noexcept {
  arming_ = disarming_ = 0;
  if (armed == armed_) return Event::none;
  armed_ = armed;
  return armed ? Event::armed : Event::disarmed;
}

void IqThrottle::power_up(const IqMemory& memory) noexcept {
  arming_ = disarming_ = 0;
  armed_ = memory.value(kArming, 1) != 0;
}

std::optional<MotorDrive> IqThrottle::asked(double throttle, const IqMemory& memory) noexcept {
  if (std::abs(throttle - memory.finite(kParser, 9)) <= memory.finite(kParser, 10)) return std::nullopt;
  const int sign = static_cast<int>(memory.value(kParser, 3));
  if (sign < 1 || sign > 4) return std::nullopt;  // unconfigured
  double share = sign <= 2 ? 2 * throttle - 1 : throttle;
  if (sign % 2 == 0) share = -share;
  if (share < 0 && memory.value(kParser, 8) != 0) share = -share;
  share *= memory.finite(kParser, 7);
  MotorDrive drive;
  switch (static_cast<int>(memory.value(kParser, 0))) {
    case 0:
      drive.mode = MotorDrive::Mode::pwm;
      drive.target = share;
      return drive;
    case 1:
      drive.mode = MotorDrive::Mode::volts;
      drive.target = share * memory.finite(kParser, 4);
      return drive;
    case 2:
      drive.mode = MotorDrive::Mode::velocity;
      drive.target = share * memory.finite(kParser, 5);
      return drive;
    default:
      return std::nullopt;  // thrust is not in this firmware
  }
}

}  // namespace kphi::sim
