#include "drivers/netbox/receive/load_cell.hpp"

#include <fmt/format.h>
#include <linux/futex.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "base/error.hpp"
#include "base/thread.hpp"
#include "drivers/netbox/configuration/http.hpp"

namespace kphi::netbox {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::nanoseconds kHttpTimeout = 5s;
constexpr std::chrono::nanoseconds kHealthPeriod = 20ms;
constexpr std::chrono::nanoseconds kLongestLinger = 250ms, kQuiet = 50ms;
constexpr int kBatchesPerDrain = 64;

std::string fetch_configuration(const Address& address, std::chrono::nanoseconds wall_timeout,
                                std::chrono::nanoseconds refused_for) {
  return http_get(address.where(), address.http_port, "/netftapi2.xml", wall_timeout, 200, refused_for);
}

/// True if a descriptor became readable within `wall`.
bool poll_for(std::span<pollfd> descriptors, std::chrono::nanoseconds wall) noexcept {
  const timespec timeout = to_timespec(std::max(wall, 0ns));
  return ppoll(descriptors.data(), descriptors.size(), &timeout, nullptr) > 0;
}

void sleep_for(Duration wall) {
  const real_time::Asleep asleep(wall);
  std::this_thread::sleep_for(wall);
}

}  // namespace

LoadCell::LoadCell(const Address& address, const Clock& clock)
    : address_(address),
      clock_(clock),
      configuration_(
          parse_configuration(fetch_configuration(address, kHttpTimeout, kRefusedFor), "Net Box " + address.host)),
      socket_(address.where(), address.rdt_port),
      connection_(configuration_, to_seconds(clock.stretched(1s))),
      inquirer_(start_thread({"box inquiries"}, [this] { answer_questions(); })) {}

LoadCell::~LoadCell() {
  stop();
  inquiry_ = Inquiry::ending;
  inquiry_.notify_one();
  inquirer_.join();
}

void LoadCell::start() {
  stop();
  const auto fail = [&](const std::string& cause, const char* next_move) {
    throw DeviceError(fmt::format("Net Box {}:{}", address_.host, address_.rdt_port), "start the stream", cause,
                      next_move);
  };
  if (!configuration_.rdt_enabled) fail("RDT is disabled (comrdte)", "enable RDT on the box's Communications page");
  stopping_ = false;
  order_wakeup_.clear();
  state_ = State::starting;
  thread_ = start_thread({"load cell", true}, [this] { run(); });
  // The session ends this by itself: it either streams or gives up.
  state_.wait(State::starting);
  if (state_ != State::failed) return;
  stop();
  if (socket_.refusals() > 0)
    fail("the box is reachable but refuses the RDT port",
         "check rdt_port, and that RDT is enabled on the box's Communications page");
  if (socket_.last_error() != 0) fail(std::strerror(socket_.last_error()), "check this computer's network settings");
  fail(fmt::format("no record after {} requests", connection_.settings().attempts),
       "check that no firewall blocks UDP and that no other program uses the box");
}

void LoadCell::stop() noexcept {
  if (!thread_.joinable()) return;
  stopping_ = true;
  order_wakeup_.raise();
  thread_.join();
}

void LoadCell::set_bias() noexcept {
  bias_requested_ = true;
  order_wakeup_.raise();
}

bool LoadCell::wait(std::chrono::nanoseconds wall) noexcept {
  const auto deadline = std::chrono::steady_clock::now() + wall;
  for (auto left = wall; connection_.empty() && left > 0ns; left = deadline - std::chrono::steady_clock::now()) {
    consumer_waits_ = 1;
    std::atomic_thread_fence(std::memory_order_seq_cst);
    const timespec timeout = to_timespec(left);
    if (connection_.empty()) syscall(SYS_futex, &consumer_waits_, FUTEX_WAIT_PRIVATE, 1, &timeout, nullptr, 0);
    consumer_waits_ = 0;
  }
  return !connection_.empty();
}

ReceiveBuffer LoadCell::receive_buffer() const {
  const double records = configuration_.records_per_datagram;
  return {socket_.receive_buffer_bytes(), kRecordBytes * static_cast<std::size_t>(records),
          clock_.shrunk(from_seconds(records / configuration_.rdt_rate_hz))};
}

void LoadCell::run() noexcept {
  // By default the kernel may make each sleep 50 us longer.
  prctl(PR_SET_TIMERSLACK, 1);
  bias_requested_ = false;
  connection_.start(clock_.now());
  while (!stopping_ && connection_.state() != State::failed) pump();
  connection_.stop(clock_.now());
  send_requests();
  hand_over();
  linger();
  publish(true);
}

void LoadCell::pump() noexcept {
  if (bias_requested_.exchange(false)) connection_.set_bias(clock_.now());
  if (stopping_) return;
  send_requests();
  wait_for_datagrams();
  drain();
  exchange_answers();
  const Instant now = clock_.now();
  connection_.advance(now);
  exchange_answers();
  hand_over();
  publish(now >= health_due_);
  if (now >= health_due_) health_due_ = now + clock_.stretched(kHealthPeriod);
}

void LoadCell::wait_for_datagrams() noexcept {
  // Polls when the box is silent, so that the silence and orders are noticed at once.
  const bool gathers = drained_ > 0 && connection_.state() == State::streaming;
  const Instant now = clock_.now();
  if (const auto wall = gathers ? clock_.shrunk(connection_.gathering_time(now)) : 0ns; wall > 0ns)
    return sleep_for(wall);
  std::array<pollfd, 2> both{{{order_wakeup_.descriptor(), POLLIN, 0}, {socket_.descriptor(), POLLIN, 0}}};
  const Instant due = connection_.deadline();
  const Duration wall = due == kNever ? 1h : clock_.shrunk(due - now);
  const real_time::Asleep asleep(wall);
  poll_for(both, wall);
  if (both[0].revents != 0) order_wakeup_.clear();
}

void LoadCell::drain() noexcept {
  drained_ = 0;
  for (int batch = 0; batch < kBatchesPerDrain; ++batch) {
    const Instant asked = clock_.now();
    const std::span<const UdpSocket::Datagram> datagrams = socket_.receive();
    if (!datagrams.empty()) {
      // The clock is read once for all. A stamp is calendar time, which may step by years: no datagram came after it
      // was taken, nor before the socket was last seen empty.
      const Instant taken = clock_.now();
      const timespec& first = datagrams.front().stamp;
      const bool stamped = first.tv_sec != 0;
      const Instant at_first = stamped ? clock_.at_realtime(first) : taken;
      for (const UdpSocket::Datagram& datagram : datagrams) {
        connection_.note_host_drops(datagram.dropped);
        const Instant arrival =
            stamped ? at_first + clock_.stretched(to_duration(datagram.stamp) - to_duration(first)) : at_first;
        connection_.receive(datagram.bytes, std::clamp(arrival, std::min(emptied_, taken), taken));
      }
      drained_ += datagrams.size();
    }
    if (datagrams.size() < UdpSocket::kBatch) {
      emptied_ = asked;
      break;
    }
  }
}

void LoadCell::hand_over() noexcept {
  if (!connection_.deliver()) return;
  std::atomic_thread_fence(std::memory_order_seq_cst);
  if (consumer_waits_.load(std::memory_order_relaxed) != 0 && consumer_waits_.exchange(0) != 0)
    syscall(SYS_futex, &consumer_waits_, FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0);
}

void LoadCell::send_requests() noexcept {
  std::array<std::uint8_t, 8> request;
  while (connection_.next_request(request)) socket_.send(request);
}

void LoadCell::exchange_answers() noexcept {
  if (inquiry_ == Inquiry::answered) {
    connection_.answered(std::move(answer_), clock_.now());
    inquiry_ = Inquiry::none;
  }
  if (inquiry_ != Inquiry::none || !connection_.next_question()) return;
  inquiry_ = Inquiry::asked;
  inquiry_.notify_one();
}

/// A thread of its own asks over HTTP, so that the receive thread never waits for an answer.
void LoadCell::answer_questions() noexcept {
  for (Inquiry present = inquiry_; present != Inquiry::ending; present = inquiry_) {
    if (present != Inquiry::asked) {
      inquiry_.wait(present);
      continue;
    }
    // A refusal is an answer here: the box was away, or boots.
    answer_ = ask_box([this] { return fetch_configuration(address_, kAnswerTimeout, 0ns); });
    inquiry_.compare_exchange_strong(present, Inquiry::answered);  // unless it is `ending` by now
    order_wakeup_.raise();
  }
}

/// Repeats the stop if the box continues to send.
void LoadCell::linger() noexcept {
  const Instant give_up = clock_.now() + clock_.stretched(kLongestLinger);
  pollfd readable{socket_.descriptor(), POLLIN, 0};
  while (clock_.now() < give_up && poll_for({&readable, 1}, kQuiet)) {
    drain();
    send_requests();
  }
}

void LoadCell::publish(bool with_health) noexcept {
  counters_.publish(connection_.counters());
  if (with_health) health_.publish(connection_.health());
  const State state = connection_.state();
  if (state_ == state) return;
  state_ = state;
  state_.notify_all();
}

}  // namespace kphi::netbox
