#include "drivers/iq/link.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <boost/asio/write.hpp>
#include <cerrno>
#include <cmath>

#include "drivers/device_error.hpp"
#include "drivers/iq/motor.hpp"

namespace kphi::iq {
namespace {

using std::chrono::steady_clock;
constexpr auto kConnectLimit = std::chrono::seconds(10);
constexpr auto kStopLimit = std::chrono::milliseconds(600);
constexpr auto kLastWordsLimit = std::chrono::milliseconds(200);
constexpr auto kLongestNap = std::chrono::seconds(1);

Settings stretched(Settings settings, unsigned baud, const Clock& clock) {
  if (settings.reply_timeout == Duration{0}) settings.reply_timeout = clock.stretched(std::chrono::milliseconds(100));
  if (settings.wire_byte_time == Duration{0} && baud > 0) settings.wire_byte_time = from_seconds(10.0 / baud);
  if (settings.longest_silence == Duration{0}) {
    settings.longest_silence = clock.stretched(from_seconds(settings.module_timeout_s));
  }
  return settings;
}

std::int64_t nanoseconds(steady_clock::time_point time) noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
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

Link::Link(const std::string& device, unsigned baud, Settings settings, const Clock& clock)
    : device_(device),
      clock_(clock),
      port_(io_, device, baud),
      bell_(io_, make_bell()),
      timer_(io_),
      session_(stretched(settings, baud, clock)) {
  thread_ = std::thread([this] { run(); });
  try {
    wait_until_ready(baud);
  } catch (...) {
    shut_down();
    throw;
  }
}

Link::~Link() { shut_down(); }

void Link::wait_until_ready(unsigned baud) {
  std::unique_lock lock(mutex_);
  const bool decided = changed_.wait_for(lock, kConnectLimit, [&] {
    return ended_ || state_ == Session::State::ready || state_ == Session::State::failed;
  });
  if (decided && !ended_ && state_ == Session::State::ready) return;
  throw DeviceError("motor module on " + device_, fmt::format("connect at {} baud", baud),
                    decided ? failure_ : std::string("it did not come to an end in time"),
                    "check its supply, RX and TX, the baud rate and the module id");
}

void Link::shut_down() noexcept {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stop_asked_ = true;
    wanted_speed_.reset();
  }
  ring();
  thread_.join();
}

void Link::spin_at(RadPerSec signed_speed) {
  if (!(std::abs(signed_speed.value()) <= entry<"propeller_motor_control.ctrl_velocity">.max)) {
    throw std::invalid_argument(fmt::format("speed {} rad/s is beyond what the module takes", signed_speed.value()));
  }
  {
    const std::lock_guard lock(mutex_);
    if (!alive_ || stop_asked_) {
      throw DeviceError("motor module on " + device_, "spin", failure_.empty() ? "it is being stopped" : failure_,
                        "connect again");
    }
    renew();
    wanted_speed_ = signed_speed;
  }
  ring();
}

void Link::renew() noexcept { lease_end_ns_ = nanoseconds(steady_clock::now()) + Motor::kLease.count(); }

std::uint64_t Link::ask_coast() noexcept {
  std::uint64_t mine = 0;
  {
    const std::lock_guard lock(mutex_);
    wanted_speed_.reset();
    mine = ++coasts_asked_;
  }
  ring();
  return mine;
}

bool Link::coast_and_confirm(Duration wall) noexcept {
  const std::uint64_t mine = ask_coast();
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, wall, [&] { return ended_ || coasts_confirmed_ >= mine; });
  return coasts_confirmed_ >= mine;
}

std::string Link::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

Identity Link::identity() const {
  const std::lock_guard lock(mutex_);
  return identity_;
}

Counters Link::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

void Link::ring() noexcept {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(bell_.native_handle(), &one, sizeof one);
}

bool Link::lease_over(WallTime wall) const noexcept { return nanoseconds(wall) >= lease_end_ns_; }

void Link::run() noexcept {
  refuse_signals();
  try {
    read();
    listen();
    session_.connect(clock_.now());
    pump();
    io_.run();
  } catch (const std::exception& error) {
    lose(error.what());
  }
  last_words();
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    alive_ = false;
  }
  changed_.notify_all();
}

void Link::read() {
  port_.stream().async_read_some(boost::asio::buffer(read_buffer_), [this](const auto& error, std::size_t n) {
    if (error) return lose(fmt::format("the port is gone ({}): adapter unplugged?", error.message()));
    session_.receive(std::span(read_buffer_).first(n), clock_.now());
    pump();
    read();
  });
}

void Link::listen() {
  bell_.async_wait(boost::asio::posix::stream_descriptor::wait_read, [this](const auto& error) {
    if (error) return;
    std::uint64_t rings = 0;
    [[maybe_unused]] const auto got = ::read(bell_.native_handle(), &rings, sizeof rings);
    obey();
    pump();
    listen();
  });
}

void Link::obey() {
  std::optional<RadPerSec> speed;
  std::uint64_t coasts = 0;
  bool stop = false;
  {
    const std::lock_guard lock(mutex_);
    speed = std::exchange(wanted_speed_, std::nullopt);
    coasts = coasts_asked_;
    stop = stop_asked_;
  }
  const Instant now = clock_.now();
  if (coasts != coasts_obeyed_) {
    coasts_obeyed_ = coasts;
    session_.coast(now);
  }
  if (stop && !stopping_) {
    stopping_ = true;
    stop_deadline_ = steady_clock::now() + kStopLimit;
    for (int i = 0; i < 3; ++i) session_.coast(now);
  }
  if (!speed || stopping_ || session_.state() != Session::State::ready) return;
  if (lease_over(steady_clock::now())) {
    ++lease_expiries_;
  } else {
    session_.spin_at(*speed, now);
  }
}

void Link::pump() {
  const WallTime wall = steady_clock::now();
  keep_lease(wall);
  write();
  move_readings();
  publish();
  end_if_stopped(wall);
  arm(wall);
}

void Link::write() {
  const auto bytes = session_.output();
  if (writing_ || bytes.empty()) return;
  writing_ = true;
  std::copy(bytes.begin(), bytes.end(), write_buffer_.begin());
  boost::asio::async_write(port_.stream(), boost::asio::buffer(write_buffer_, bytes.size()),
                           [this](const auto& error, std::size_t) {
                             writing_ = false;
                             if (error) return lose(fmt::format("the port is gone ({})", error.message()));
                             pump();
                           });
  session_.sent(bytes.size());
}

void Link::move_readings() {
  std::array<Reading, 64> batch;
  while (const std::size_t n = session_.take(batch)) dropped_readings_ += n - queue_.push(batch.data(), n);
  newest_reading_ns_ = session_.newest_reading().count();
}

void Link::keep_lease(WallTime wall) {
  if (!session_.spinning() || !lease_over(wall)) return;
  ++lease_expiries_;
  session_.coast(clock_.now());
}

void Link::end_if_stopped(WallTime wall) {
  if (!stopping_) return;
  if ((session_.coasting() && !writing_ && session_.output().empty()) || wall >= stop_deadline_) io_.stop();
}

void Link::arm(WallTime wall) {
  WallTime due = wall + kLongestNap;
  const Instant deadline = session_.deadline();
  if (deadline != kNever) due = std::min(due, wall + clock_.shrunk(std::max(deadline - clock_.now(), Duration{0})));
  if (session_.spinning()) due = std::min(due, WallTime(std::chrono::nanoseconds(lease_end_ns_)));
  if (stopping_) due = std::min(due, stop_deadline_);
  if (due >= armed_) return;
  armed_ = due;
  timer_.expires_at(due);
  timer_.async_wait([this](const auto& error) {
    if (error) return;
    armed_ = WallTime::max();
    session_.advance(clock_.now());
    pump();
  });
}

void Link::publish() {
  const Session::State state = session_.state();
  bool news = false;
  {
    const std::lock_guard lock(mutex_);
    counters_ = session_.counters();
    counters_.dropped_readings += dropped_readings_;
    counters_.lease_expiries = lease_expiries_;
    if (state != state_) {
      state_ = state;
      identity_ = session_.identity();
      failure_ = session_.failure();
      alive_ = state != Session::State::failed;
      news = true;
    }
    if (session_.coasting() && coasts_confirmed_ != coasts_obeyed_) {
      coasts_confirmed_ = coasts_obeyed_;
      news = true;
    }
  }
  if (news) changed_.notify_all();
}

void Link::lose(const std::string& why) {
  {
    const std::lock_guard lock(mutex_);
    if (failure_.empty()) failure_ = why;
    alive_ = false;
  }
  changed_.notify_all();
  io_.stop();
}

// Past the session, so that an error inside it cannot prevent it. A batch cut short is no harm: the module rescans
// behind a bad CRC, and there are three.
void Link::last_words() noexcept {
  const auto end = steady_clock::now() + kLastWordsLimit;
  std::array<std::uint8_t, kMaxFrame> frame;
  const std::size_t size = encode(set<"propeller_motor_control.ctrl_coast">(session_.settings().module_id), frame);
  std::array<std::uint8_t, 3 * kMaxFrame> thrice;
  for (std::size_t i = 0; i < 3; ++i) std::copy_n(frame.begin(), size, thrice.begin() + i * size);
  std::span<const std::uint8_t> rest(thrice.data(), 3 * size);
  while (!rest.empty() && steady_clock::now() < end) {
    const auto n = ::write(port_.native_handle(), rest.data(), rest.size());
    if (n > 0) {
      rest = rest.subspan(static_cast<std::size_t>(n));
    } else if (n < 0 && errno == EAGAIN) {
      pollfd room{port_.native_handle(), POLLOUT, 0};
      ::poll(&room, 1, 10);
    } else if (n == 0 || errno != EINTR) {
      return;
    }
  }
  // Closing may throw away what has not left yet.
  int waiting = 0;
  while (ioctl(port_.native_handle(), TIOCOUTQ, &waiting) == 0 && waiting > 0 && steady_clock::now() < end) {
    ::poll(nullptr, 0, 2);
  }
}

}  // namespace kphi::iq
