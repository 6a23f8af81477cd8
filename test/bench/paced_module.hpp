// A fake module on a pseudo-terminal whose bytes take as long as on a wire, in both directions.
#pragma once

#include <poll.h>
#include <sys/prctl.h>
#include <time.h>

#include <atomic>
#include <chrono>
#include <deque>
#include <thread>

#include "test/drivers/iq/fake_module.hpp"
#include "test/drivers/serial/pseudo_terminal.hpp"

namespace kphi::iq::fake {

class PacedModule {
 public:
  explicit PacedModule(unsigned baud) : byte_time_(std::chrono::nanoseconds(10'000'000'000 / baud)) {
    module_.turns_at_once = false;
    thread_ = std::thread([this] { run(); });
  }
  ~PacedModule() {
    stop_ = true;
    thread_.join();
  }
  PacedModule(const PacedModule&) = delete;
  PacedModule& operator=(const PacedModule&) = delete;

  [[nodiscard]] const std::string& device() const { return terminal_.name(); }
  /// CPU time of its thread, s.
  [[nodiscard]] double cpu_seconds() const { return 1e-9 * static_cast<double>(cpu_ns_.load()); }

 private:
  using Clock = std::chrono::steady_clock;
  struct Departure {
    Clock::time_point at;
    Bytes bytes;
  };

  void run() {
    prctl(PR_SET_TIMERSLACK, 1UL);
    while (!stop_) {
      wait();
      hear();
      speak();
      module_.heard.clear();
      timespec cpu{};
      clock_gettime(CLOCK_THREAD_CPUTIME_ID, &cpu);
      cpu_ns_ = cpu.tv_sec * 1'000'000'000L + cpu.tv_nsec;
    }
  }
  void wait() {
    auto left = std::chrono::nanoseconds(std::chrono::milliseconds(20));
    if (!departures_.empty()) left = std::min(left, std::chrono::nanoseconds(departures_.front().at - Clock::now()));
    const timespec limit{0, std::max<long>(left.count(), 0)};
    pollfd line{terminal_.master(), POLLIN, 0};
    ppoll(&line, 1, &limit, nullptr);
  }
  /// Each request is there when its last byte would be.
  void hear() {
    pollfd line{terminal_.master(), POLLIN, 0};
    if (::poll(&line, 1, 0) <= 0) return;
    std::uint8_t buffer[512];
    const auto n = ::read(terminal_.master(), buffer, sizeof buffer);
    for (long i = 0; i < n; ++i) {
      heard_at_ = std::max(heard_at_, Clock::now()) + byte_time_;
      for (Bytes& reply : module_.receive(std::span(buffer + i, 1))) {
        said_at_ = std::max(said_at_, heard_at_) + byte_time_ * static_cast<long>(reply.size());
        departures_.push_back({said_at_, std::move(reply)});
      }
    }
  }
  void speak() {
    while (!departures_.empty() && departures_.front().at <= Clock::now()) {
      const Bytes& bytes = departures_.front().bytes;
      [[maybe_unused]] const auto written = ::write(terminal_.master(), bytes.data(), bytes.size());
      departures_.pop_front();
    }
  }

  const std::chrono::nanoseconds byte_time_;
  serial::fake::PseudoTerminal terminal_;
  Module module_;
  Clock::time_point heard_at_{}, said_at_{};
  std::deque<Departure> departures_;
  std::atomic<long> cpu_ns_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace kphi::iq::fake
