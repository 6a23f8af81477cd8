#include "drivers/iq/link.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "drivers/iq/motor.hpp"
#include "drivers/serial/discovery.hpp"

namespace kphi::iq {
namespace {

using std::chrono::steady_clock;
constexpr auto kConnectLimit = std::chrono::seconds(10);
constexpr auto kLastWordsLimit = std::chrono::milliseconds(200);
constexpr auto kLongestNap = std::chrono::seconds(1);
constexpr auto kPublishEvery = std::chrono::milliseconds(5);
constexpr auto kFirstPause = std::chrono::milliseconds(50);
constexpr auto kLongestPause = std::chrono::seconds(1);

std::vector<Settings> stretched(std::vector<Settings> modules, const std::string& device, unsigned baud,
                                const Clock& clock) {
  const bool adapter = serial::adapter_of(device).has_value();
  for (Settings& settings : modules) {
    settings.wire_paces |= adapter;
    if (settings.reply_timeout == Duration{0}) settings.reply_timeout = clock.stretched(std::chrono::milliseconds(100));
    if (settings.wire_byte_time == Duration{0} && baud > 0) settings.wire_byte_time = from_seconds(10.0 / baud);
    if (settings.longest_silence == Duration{0}) {
      settings.longest_silence = clock.stretched(from_seconds(settings.module_timeout_s));
    }
  }
  return modules;
}

int make_bell() {
  const int fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (fd < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  return fd;
}

/// Signals belong to the program's main thread.
void refuse_signals() noexcept {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
}

}  // namespace

Link::Link(const std::string& device, unsigned baud, const std::vector<Settings>& modules, const Clock& clock,
           const std::string& capture)
    : device_(device),
      baud_(baud),
      clock_(clock),
      bell_(make_bell()),
      bus_(stretched(modules, device, baud, clock)),
      reopening_(kFirstPause, kLongestPause),
      reconnecting_(kFirstPause, kLongestPause),
      was_ready_(modules.size(), false),
      suspended_(clock.suspended()) {
  for (const Settings& settings : modules) {
    const std::string name = modules.size() == 1 ? "motor module on " + device
                                                 : fmt::format("motor module {} on {}", settings.module_id, device);
    seats_.push_back(std::make_unique<Seat>(name, [this] { ring(); }));
  }
  try {
    port_ = std::make_unique<serial::Port>(device, baud);
    if (!capture.empty()) capture_ = std::make_unique<Capture>(capture);
    thread_ = std::thread([this] { run(); });
    wait_until_ready();
  } catch (...) {
    end_thread();
    throw;
  }
}

Link::~Link() { end_thread(); }

void Link::wait_until_ready() {
  for (std::size_t i = 0; i < seats_.size(); ++i) {
    const auto connected = seats_[i]->await_connection(kConnectLimit);
    if (connected.value_or(false)) continue;
    throw DeviceError("motor module on " + device_, fmt::format("connect at {} baud", baud_),
                      connected ? seats_[i]->failure() : std::string("it did not come to an end in time"),
                      "check its supply, RX and TX, the baud rate and the module id");
  }
}

void Link::end_thread() noexcept {
  quit_ = true;
  ring();
  if (thread_.joinable()) thread_.join();
  ::close(bell_);
}

void Link::ring() noexcept {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(bell_, &one, sizeof one);
}

void Link::run() noexcept {
  refuse_signals();
  std::string why = "it is being stopped";
  try {
    bus_.connect_anew(clock_.now());
    while (!quit_) turn();
  } catch (const std::exception& error) {
    why = error.what();
  }
  last_words();
  for (auto& seat : seats_) seat->end(why);
}

void Link::turn() {
  try {
    speak();
    publish();
    const Woken woken = sleep();
    notice_sleep();
    if (woken.by_port) hear();
    bus_.advance(clock_.now());
    if (woken.by_bell) obey();
    keep_leases();
  } catch (const serial::PortGone& gone) {
    lose(gone.what());
  }
  recover();
}

Link::Woken Link::sleep() {
  const auto left = std::max(due() - steady_clock::now(), steady_clock::duration{0});
  const auto ns = std::chrono::nanoseconds(left).count();
  const timespec limit{static_cast<time_t>(ns / 1'000'000'000), ns % 1'000'000'000};
  pollfd fds[2] = {{bell_, POLLIN, 0}, {-1, 0, 0}};
  if (port_) fds[1] = {port_->fd(), static_cast<short>(congested_ ? POLLIN | POLLOUT : POLLIN), 0};
  if (ppoll(fds, 2, &limit, nullptr) <= 0) return {};
  std::uint64_t rings = 0;
  if (fds[0].revents != 0 && ::read(bell_, &rings, sizeof rings) < 0 && errno != EAGAIN) {
    throw std::system_error(errno, std::generic_category(), "eventfd");
  }
  return {fds[0].revents != 0, fds[1].revents != 0};
}

Link::WallTime Link::due() const {
  const WallTime now = steady_clock::now();
  WallTime due = now + kLongestNap;
  if (!port_) return std::min(due, next_attempt_);
  const Instant deadline = bus_.deadline();
  if (deadline != kNever) due = std::min(due, now + clock_.shrunk(std::max(deadline - clock_.now(), Duration{0})));
  for (std::size_t i = 0; i < seats_.size(); ++i) {
    if (bus_.module(i).spinning()) due = std::min(due, seats_[i]->lease_end());
    if (bus_.module(i).state() == Session::State::failed && next_attempt_ > now) due = std::min(due, next_attempt_);
  }
  return due;
}

// Reading also finds out that the port is gone.
void Link::hear() {
  std::array<std::uint8_t, 4096> buffer;
  while (const std::size_t n = port_->read(buffer)) {
    const auto bytes = std::span(buffer).first(n);
    const Instant now = clock_.now();
    if (capture_) capture_->add(Capture::Direction::came, bytes, now);
    bus_.receive(bytes, now);
    if (n < buffer.size()) return;
  }
}

void Link::obey() {
  for (std::size_t i = 0; i < seats_.size(); ++i) obey(seats_[i]->take_orders(), *seats_[i], bus_.module(i));
}

void Link::obey(const Orders& orders, Seat& seat, Session& session) {
  const Instant now = clock_.now();
  if (orders.emergency) session.emergency_stop(now);
  if (orders.coast && !orders.emergency) session.coast(now);
  if (orders.stop) session.stop(*orders.stop, now);
  if (orders.rearm && session.state() == Session::State::ready) session.rearm();
  if (orders.inquiry && session.state() == Session::State::ready) session.inquire(*orders.inquiry, now);
  if (!orders.speed || !session.armed()) return;
  if (steady_clock::now() < seat.lease_end()) {
    session.spin_at(*orders.speed, now);
  } else {
    seat.count_lease_expiry();
  }
}

/// While this computer slept the module has let the motor go: what was ordered before is void.
void Link::notice_sleep() {
  const Duration suspended = clock_.suspended();
  const Duration slept = suspended - suspended_;
  if (slept < kShortestSleep) return;
  suspended_ = suspended;
  for (std::size_t i = 0; i < bus_.size(); ++i)
    bus_.module(i).fail(EventKind::host_absent, fmt::format("this computer slept for {:.2g} s", to_seconds(slept)),
                        clock_.now());
}

void Link::keep_leases() {
  const WallTime now = steady_clock::now();
  for (std::size_t i = 0; i < seats_.size(); ++i) {
    if (!bus_.module(i).spinning() || now < seats_[i]->lease_end()) continue;
    seats_[i]->count_lease_expiry();
    bus_.module(i).expire_lease(clock_.now());
  }
}

void Link::recover() {
  if (steady_clock::now() < next_attempt_) return;
  if (!port_) {
    reopen();
  } else {
    reconnect_modules();
  }
}

void Link::reopen() {
  try {
    port_ = std::make_unique<serial::Port>(device_, baud_);
    bus_.connect_anew(clock_.now());
  } catch (const DeviceError&) {
    next_attempt_ = steady_clock::now() + reopening_.next();
  }
}

// A module that failed goes on coasting until it confirms; then its settings are looked at again.
void Link::reconnect_modules() {
  bool all_rest = true, any_failed = false, all_ready = true, all_known = true;
  for (std::size_t i = 0; i < bus_.size(); ++i) {
    const Session& session = bus_.module(i);
    all_known &= session.was_connected();
    any_failed |= session.state() == Session::State::failed;
    all_rest &= session.state() != Session::State::failed || session.coasting();
    all_ready &= session.state() == Session::State::ready;
    if (session.state() == Session::State::ready && !was_ready_[i]) {
      if (!session.armed()) seats_[i]->count_reconnection();
      was_ready_[i] = true;
    }
    if (session.state() == Session::State::failed) was_ready_[i] = false;
  }
  if (all_ready) {
    reopening_.reset();
    reconnecting_.reset();
  }
  if (!any_failed || !all_rest || !all_known) return;
  next_attempt_ = steady_clock::now() + reconnecting_.next();
  for (std::size_t i = 0; i < bus_.size(); ++i) {
    if (bus_.module(i).state() == Session::State::failed) bus_.module(i).connect(clock_.now());
  }
}

void Link::speak() {
  congested_ = false;
  if (!port_) return;
  notice_sleep();
  for (auto bytes = bus_.output(); !bytes.empty(); bytes = bus_.output()) {
    const std::size_t n = port_->write(bytes);
    if (capture_ && n > 0) capture_->add(Capture::Direction::sent, bytes.first(n), clock_.now());
    bus_.sent(n);
    if (n > 0) continue;
    congested_ = true;
    return;
  }
}

void Link::publish() {
  const WallTime now = steady_clock::now();
  const bool all = now - published_ >= kPublishEvery;
  if (all) published_ = now;
  for (std::size_t i = 0; i < seats_.size(); ++i) {
    seats_[i]->move_readings(bus_.module(i));
    seats_[i]->publish(bus_.module(i), port_ != nullptr, all);
  }
}

void Link::lose(const std::string& why) {
  port_.reset();
  congested_ = false;
  was_ready_.assign(was_ready_.size(), false);
  bus_.lose(why, clock_.now());
  next_attempt_ = steady_clock::now() + reopening_.next();
}

// Past the sessions, so that an error inside them cannot prevent it. A batch cut short is no harm: the module rescans
// behind a bad CRC, and there are three.
void Link::last_words() noexcept {
  if (!port_) return;
  const auto end = steady_clock::now() + kLastWordsLimit;
  try {
    for (std::size_t i = 0; i < 3 * bus_.size(); ++i) {
      std::array<std::uint8_t, kMaxFrame> frame;
      const int id = bus_.module(i % bus_.size()).settings().module_id;
      std::span<const std::uint8_t> rest =
          std::span(frame).first(encode(set<"propeller_motor_control.ctrl_coast">(id), frame));
      while (!rest.empty() && steady_clock::now() < end) {
        const std::size_t n = port_->write(rest);
        if (capture_ && n > 0) capture_->add(Capture::Direction::sent, rest.first(n), clock_.now());
        rest = rest.subspan(n);
        if (n > 0) continue;
        pollfd room{port_->fd(), POLLOUT, 0};
        ::poll(&room, 1, 10);
      }
    }
  } catch (const std::exception&) {
    return;  // the port is gone
  }
  // Closing may throw away what has not left yet.
  port_->drain(end - steady_clock::now());
}

}  // namespace kphi::iq
