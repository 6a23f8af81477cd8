#include "drivers/iq/motor.hpp"

#include "drivers/iq/link.hpp"

namespace kphi::iq {
namespace {

constexpr auto kStopLimit = std::chrono::milliseconds(600);

}  // namespace

Motor::Motor(std::string device, unsigned baud, Settings settings, const Clock& clock, const std::string& capture)
    : Motor(std::make_shared<Link>(device, baud, std::vector{settings}, clock, capture), 0) {}

Motor::Motor(std::shared_ptr<Link> link, std::size_t seat) : link_(std::move(link)), seat_(link_->seat(seat)) {}

Motor::~Motor() { (void)seat_.await_coast(seat_.coast(true), kStopLimit); }

std::vector<std::unique_ptr<Motor>> Motor::on_one_line(const std::string& device, unsigned baud,
                                                       const std::vector<Settings>& modules, const Clock& clock,
                                                       const std::string& capture) {
  const auto link = std::make_shared<Link>(device, baud, modules, clock, capture);
  std::vector<std::unique_ptr<Motor>> motors;
  for (std::size_t i = 0; i < modules.size(); ++i) motors.emplace_back(new Motor(link, i));
  return motors;
}

void Motor::spin_at(RadPerSec signed_speed) { seat_.spin_at(signed_speed, kLease); }
void Motor::renew() noexcept { seat_.renew(kLease); }
void Motor::coast() noexcept { seat_.coast(false); }
void Motor::emergency_stop() noexcept { seat_.coast(true); }
bool Motor::coast_and_confirm(Duration wall) noexcept { return seat_.await_coast(seat_.coast(false), wall); }
StopReport Motor::stop(const StopSettings& settings) { return seat_.stop(settings, kLease); }
std::vector<Reply> Motor::inquire(std::vector<Inquiry> inquiries) { return seat_.inquire(std::move(inquiries)); }
std::size_t Motor::take(std::span<Reading> out) { return seat_.take(out); }
std::vector<Event> Motor::take_events() { return seat_.take_events(); }
bool Motor::alive() const noexcept { return seat_.alive(); }
bool Motor::connected() const { return seat_.connected(); }
void Motor::rearm() { seat_.rearm(); }
std::string Motor::failure() const { return seat_.failure(); }
const std::string& Motor::device() const noexcept { return link_->device(); }
Identity Motor::identity() const { return seat_.identity(); }
Counters Motor::counters() const { return seat_.counters(); }
RoundTripHistogram Motor::round_trips() const { return seat_.round_trips(); }
Instant Motor::newest_reading() const noexcept { return seat_.newest_reading(); }

}  // namespace kphi::iq
