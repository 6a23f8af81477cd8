#include "drivers/iq/motor.hpp"

#include "drivers/iq/link.hpp"

namespace kphi::iq {

Motor::Motor(std::string device, unsigned baud, Settings settings, const Clock& clock)
    : link_(std::make_unique<Link>(device, baud, settings, clock)) {}
Motor::~Motor() = default;

void Motor::spin_at(RadPerSec signed_speed) { link_->spin_at(signed_speed); }
void Motor::renew() noexcept { link_->renew(); }
void Motor::coast() noexcept { link_->coast(); }
bool Motor::coast_and_confirm(Duration wall) noexcept { return link_->coast_and_confirm(wall); }
std::size_t Motor::take(std::span<Reading> out) { return link_->take(out); }
bool Motor::alive() const noexcept { return link_->alive(); }
std::string Motor::failure() const { return link_->failure(); }
const std::string& Motor::device() const noexcept { return link_->device(); }
Identity Motor::identity() const { return link_->identity(); }
Counters Motor::counters() const { return link_->counters(); }
Instant Motor::newest_reading() const noexcept { return link_->newest_reading(); }

}  // namespace kphi::iq
