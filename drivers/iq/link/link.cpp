#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <thread>
#include <utility>

#include "base/error.hpp"
#include "base/thread.hpp"
#include "drivers/iq/link/capture.hpp"
#include "drivers/iq/link/motor.hpp"
#include "drivers/serial/port.hpp"

namespace kphi::iq {
namespace {

using std::chrono::steady_clock;
constexpr auto kStopLimit = std::chrono::milliseconds(600);
constexpr auto kConnectLimit = std::chrono::seconds(10);
constexpr auto kGiveUpEvery = std::chrono::milliseconds(20);
constexpr auto kFinalCoastLimit = std::chrono::milliseconds(200);
constexpr auto kLongestSleep = std::chrono::seconds(1);
constexpr auto kFirstPause = std::chrono::milliseconds(50);
constexpr auto kRetry = std::chrono::milliseconds(5);  // of what a caller was at
constexpr auto kLongestPause = std::chrono::seconds(1);

/// Returns the pause and doubles it.
Duration lengthen(Duration& pause) noexcept {
  return std::exchange(pause, std::min<Duration>(2 * pause, kLongestPause));
}

/// Completed for this port.
Settings stretched(Settings settings, const std::string& device, unsigned baud, const Clock& clock) {
  settings.wire_paces |= serial::adapter_of(device).has_value();
  if (settings.reply_timeout == Duration{0}) settings.reply_timeout = clock.stretched(std::chrono::milliseconds(100));
  if (settings.wire_byte_time == Duration{0} && baud > 0) settings.wire_byte_time = from_seconds(10.0 / baud);
  if (settings.longest_silence == Duration{0})
    settings.longest_silence = clock.stretched(from_seconds(settings.module_timeout_s));
  return settings;
}

}  // namespace

/// The thread between a module and its port: reads, writes, sleeps until the next deadline, watches the lease, and
/// finds the line again when it was lost. Nothing in it waits for a caller or for a disk.
class Link {
 public:
  /// Opens the device and connects; throws DeviceError. `capture`: file for all bytes; empty: no capture.
  Link(Motor& motor, unsigned baud, const Settings& settings, const Clock& clock, const std::string& capture,
       const std::function<bool()>& give_up)
      : motor_(motor),
        baud_(baud),
        clock_(clock),
        port_(std::make_unique<serial::Port>(motor.device(), baud)),
        session_(stretched(settings, port_->device(), baud, clock)),
        suspended_(clock.suspended()) {
    if (!capture.empty()) capture_ = std::make_unique<Capture>(capture);
    thread_ = start_thread({"motor", true}, [this] { run(); });
    try {
      wait_until_ready(give_up);
    } catch (...) {
      end_thread();
      throw;
    }
  }
  ~Link() { end_thread(); }

 private:
  void wait_until_ready(const std::function<bool()>& give_up) {
    std::unique_lock lock(motor_.mutex_);
    const auto limit = steady_clock::now() + kConnectLimit;
    bool decided = false, unwanted = false;
    while (!decided && !unwanted && steady_clock::now() < limit) {
      decided = motor_.changed_.wait_for(lock, kGiveUpEvery,
                                         [&] { return motor_.lost() || motor_.state_ == Session::State::ready; });
      unwanted = give_up && give_up();
    }
    if (decided && !unwanted && !motor_.lost()) return;
    throw DeviceError("motor module on " + motor_.device(), fmt::format("connect at {} baud", baud_),
                      unwanted  ? std::string("given up on request")
                      : decided ? motor_.failure_
                                : std::string("not connected in time"),
                      "check its supply, RX and TX, the baud rate and the module id");
  }

  void end_thread() noexcept {
    quit_ = true;
    motor_.commanded_.raise();
    if (thread_.joinable()) thread_.join();
  }

  // The thread.

  void run() noexcept {
    std::string why = "the link is being closed";
    try {
      session_.connect_anew(clock_.now());
      while (!quit_) turn();
    } catch (const std::exception& error) {
      why = error.what();
    }
    // Past the session, so that an error inside it cannot prevent the coast.
    if (port_) send_final_coast();
    motor_.end(why);
  }

  /// Three coasts straight to the port. A frame cut short does no harm: the module rescans after a bad CRC, and there
  /// are three.
  void send_final_coast() noexcept {
    const auto end = steady_clock::now() + kFinalCoastLimit;
    try {
      std::array<std::uint8_t, kMaxFrame> frame;
      const Packet coast =
          make(entry<"propeller_motor_control.ctrl_coast">, Access::set, session_.settings().module_id);
      const std::size_t size = encode(coast, frame);
      for (int i = 0; i < 3; ++i) {
        std::span<const std::uint8_t> rest = std::span(frame).first(size);
        while (!rest.empty() && steady_clock::now() < end) {
          const std::size_t n = port_->write(rest);
          capture_sent(rest.first(n));
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

  void turn() {
    try {
      transmit();
      motor_.move_readings(session_);
      contended_ = !motor_.publish(session_, port_ != nullptr);
      const auto [by_command, by_port] = sleep();
      notice_sleep();
      if (by_port) receive();
      session_.advance(clock_.now());
      if (by_command) has_commands_ = true;
      if (has_commands_) take_commands();
      keep_lease();
    } catch (const serial::PortGone& gone) {
      lose(gone.what());
    }
    if (steady_clock::now() >= next_attempt_) port_ ? reconnect() : reopen();
  }

  struct Woken {
    bool by_command = false, by_port = false;
  };
  Woken sleep() {
    const auto left = std::max(due() - steady_clock::now(), steady_clock::duration{0});
    const timespec limit = to_timespec(left);
    pollfd fds[2] = {{motor_.commanded_.descriptor(), POLLIN, 0}, {-1, 0, 0}};
    if (port_) fds[1] = {port_->fd(), static_cast<short>(congested_ ? POLLIN | POLLOUT : POLLIN), 0};
    const real_time::Asleep asleep(left);
    if (ppoll(fds, 2, &limit, nullptr) <= 0) return {};
    return {fds[0].revents != 0 && motor_.commanded_.clear(), fds[1].revents != 0};
  }

  [[nodiscard]] steady_clock::time_point due() const {
    const auto now = steady_clock::now();
    auto due = now + kLongestSleep;
    if (!port_) return std::min(due, next_attempt_);
    const Instant deadline = session_.deadline();
    if (deadline != kNever) due = std::min(due, now + clock_.shrunk(std::max(deadline - clock_.now(), Duration{0})));
    if (session_.spinning()) due = std::min(due, motor_.lease_end());
    if (contended_ || has_commands_) due = std::min(due, now + kRetry);
    if (session_.state() == Session::State::failed && next_attempt_ > now) due = std::min(due, next_attempt_);
    return due;
  }

  // Reading also detects that the port is gone.
  void receive() {
    std::array<std::uint8_t, 4096> buffer;
    while (const std::size_t n = port_->read(buffer)) {
      const auto bytes = std::span(buffer).first(n);
      const Instant now = clock_.now();
      if (capture_) capture_->add(Capture::Direction::came, bytes, now);
      session_.receive(bytes, now);
      if (n < buffer.size()) return;
    }
  }

  void take_commands() {
    const std::optional<Commands> commands = motor_.take_commands();
    // Afterwards, so that none of them was given before a coast that is still to come.
    if (motor_.take_coast()) session_.emergency_stop(clock_.now());
    has_commands_ = !commands;
    if (commands) apply(*commands);
  }

  void apply(const Commands& commands) {
    const Instant now = clock_.now();
    const bool is_void = commands.after_coasts < motor_.coasts_taken_;  // a coast was asked for afterwards
    if (commands.stop) session_.stop(*commands.stop, now);  // of a motor that was coasted, it orders no speed
    if (commands.inquiry && session_.state() == Session::State::ready) session_.inquire(*commands.inquiry, now);
    if (!commands.speed || is_void || !session_.armed()) return;
    if (steady_clock::now() < motor_.lease_end()) {
      session_.spin_at(*commands.speed, now);
    } else {
      ++motor_.lease_expiries_;
    }
  }

  /// While this computer slept the module stopped driving the motor: earlier orders are void.
  void notice_sleep() {
    const Duration suspended = clock_.suspended();
    const Duration slept = suspended - suspended_;
    if (slept < kShortestSleep) return;
    suspended_ = suspended;
    session_.fail(EventKind::motor_host_absent, fmt::format("this computer slept for {:.2g} s", to_seconds(slept)),
                  clock_.now());
  }

  void keep_lease() {
    if (!session_.spinning() || steady_clock::now() < motor_.lease_end()) return;
    ++motor_.lease_expiries_;
    session_.expire_lease(clock_.now());
  }

  void reopen() {
    try {
      port_ = std::make_unique<serial::Port>(motor_.device(), baud_);
      session_.connect_anew(clock_.now());
    } catch (const DeviceError&) {
      next_attempt_ = steady_clock::now() + lengthen(reopening_);
    }
  }

  // A module that failed continues coasting until it confirms; then it is connected again from the beginning.
  void reconnect() {
    if (session_.state() == Session::State::ready) {
      if (!std::exchange(was_ready_, true) && !session_.armed()) ++motor_.reconnections_;
      reopening_ = reconnecting_ = kFirstPause;
    }
    if (session_.state() != Session::State::failed) return;
    was_ready_ = false;
    if (!session_.coasting() || !session_.was_connected()) return;
    next_attempt_ = steady_clock::now() + lengthen(reconnecting_);
    session_.connect(clock_.now());
  }

  void transmit() {
    congested_ = false;
    if (!port_) return;
    notice_sleep();
    for (auto bytes = session_.output(); !bytes.empty(); bytes = session_.output()) {
      const std::size_t n = port_->write(bytes);
      capture_sent(bytes.first(n));
      session_.sent(n);
      if (n > 0) continue;
      congested_ = true;
      return;
    }
  }

  void capture_sent(std::span<const std::uint8_t> bytes) {
    if (capture_ && !bytes.empty()) capture_->add(Capture::Direction::sent, bytes, clock_.now());
  }

  void lose(const std::string& why) {
    port_.reset();
    congested_ = was_ready_ = false;
    session_.fail(EventKind::motor_port_lost, why, clock_.now());
    next_attempt_ = steady_clock::now() + lengthen(reopening_);
  }

  Motor& motor_;
  const unsigned baud_;
  const Clock& clock_;
  std::atomic<bool> quit_{false};

  // Only the thread touches these.
  std::unique_ptr<serial::Port> port_;  ///< null while it is lost
  Session session_;
  std::unique_ptr<Capture> capture_;
  bool congested_ = false;                         ///< the port had no room for all
  bool has_commands_ = false, contended_ = false;  ///< to be taken, to be published: once no caller is at them
  steady_clock::time_point next_attempt_{};
  Duration reopening_ = kFirstPause, reconnecting_ = kFirstPause;  ///< the next pauses
  bool was_ready_ = false;
  Duration suspended_;  ///< of the host, as noticed so far

  std::thread thread_;
};

Motor::Motor(const std::string& device, unsigned baud, const Settings& settings, const Clock& clock,
             const std::string& capture, const std::function<bool()>& give_up)
    : device_(device), link_(std::make_unique<Link>(*this, baud, settings, clock, capture, give_up)) {}

Motor::~Motor() { close(); }

void Motor::close() noexcept {
  if (!link_) return;
  (void)await_coast(order_coast(), kStopLimit);
  link_.reset();
}

}  // namespace kphi::iq
