// The thread between the modules of a line and its port: reads, writes, sleeps until the next deadline, watches the
// leases, and finds the line again when it was lost. Nothing in it waits for an owner or for a disk.
#pragma once

#include <memory>
#include <thread>

#include "drivers/iq/bus.hpp"
#include "drivers/iq/capture.hpp"
#include "drivers/iq/seat.hpp"
#include "drivers/serial/port.hpp"

namespace kphi::iq {

/// Counts up from the shortest to the longest pause by doubling.
class Backoff {
 public:
  Backoff(Duration shortest, Duration longest) noexcept : shortest_(shortest), longest_(longest), next_(shortest) {}
  Duration next() noexcept { return std::exchange(next_, std::min(2 * next_, longest_)); }
  void reset() noexcept { next_ = shortest_; }

 private:
  Duration shortest_, longest_, next_;
};

class Link {
 public:
  /// Opens and connects; throws DeviceError. `capture`: a file for all bytes; empty: none.
  Link(const std::string& device, unsigned baud, const std::vector<Settings>& modules, const Clock& clock,
       const std::string& capture);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  [[nodiscard]] Seat& seat(std::size_t i) noexcept { return *seats_[i]; }
  [[nodiscard]] const std::string& device() const noexcept { return device_; }

 private:
  using WallTime = std::chrono::steady_clock::time_point;

  void wait_until_ready();
  void end_thread() noexcept;
  void ring() noexcept;

  // The thread.
  void run() noexcept;
  void turn();
  struct Woken {
    bool by_bell = false, by_port = false;
  };
  Woken sleep();
  [[nodiscard]] WallTime due() const;
  void hear();
  void obey();
  void obey(const Orders& orders, Seat& seat, Session& session);
  void notice_sleep();
  void keep_leases();
  void recover();
  void reopen();
  void reconnect_modules();
  void speak();
  void publish();
  void lose(const std::string& why);
  void last_words() noexcept;

  const std::string device_;
  const unsigned baud_;
  const Clock& clock_;
  const int bell_;  ///< an eventfd: an owner has left orders
  std::vector<std::unique_ptr<Seat>> seats_;
  std::atomic<bool> quit_{false};

  // Only the thread touches these.
  std::unique_ptr<serial::Port> port_;  ///< null while it is lost
  Bus bus_;
  std::unique_ptr<Capture> capture_;
  bool congested_ = false;  ///< the port had no room for all
  WallTime next_attempt_{};
  Backoff reopening_, reconnecting_;
  std::vector<bool> was_ready_;
  WallTime published_{};
  Duration suspended_;  ///< of the host, as noticed so far

  std::thread thread_;
};

}  // namespace kphi::iq
