// The thread between a session and its port: reads, writes in batches, keeps one timer, watches the lease.
#pragma once

#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/lockfree/spsc_queue.hpp>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "drivers/iq/session.hpp"
#include "drivers/serial/port.hpp"

namespace kphi::iq {

class Link {
 public:
  Link(const std::string& device, unsigned baud, Settings settings, const Clock& clock);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  void spin_at(RadPerSec signed_speed);
  void renew() noexcept;
  void coast() noexcept { ask_coast(); }
  [[nodiscard]] bool coast_and_confirm(Duration wall) noexcept;
  std::size_t take(std::span<Reading> out) { return queue_.pop(out.data(), out.size()); }
  [[nodiscard]] bool alive() const noexcept { return alive_; }
  [[nodiscard]] std::string failure() const;
  [[nodiscard]] const std::string& device() const noexcept { return device_; }
  [[nodiscard]] Identity identity() const;
  [[nodiscard]] Counters counters() const;
  [[nodiscard]] Instant newest_reading() const noexcept { return Instant(newest_reading_ns_); }

 private:
  using WallTime = std::chrono::steady_clock::time_point;

  void wait_until_ready(unsigned baud);
  void shut_down() noexcept;
  std::uint64_t ask_coast() noexcept;
  void ring() noexcept;
  [[nodiscard]] bool lease_over(WallTime wall) const noexcept;

  // The thread.
  void run() noexcept;
  void read();
  void listen();
  void obey();
  void pump();
  void write();
  void move_readings();
  void keep_lease(WallTime wall);
  void end_if_stopped(WallTime wall);
  void arm(WallTime wall);
  void publish();
  void lose(const std::string& why);
  void last_words() noexcept;

  const std::string device_;
  const Clock& clock_;
  boost::asio::io_context io_{1};
  serial::Port port_;
  boost::asio::posix::stream_descriptor bell_;  ///< an eventfd: a caller has left something in the mailbox
  boost::asio::steady_timer timer_;

  // Only the thread touches these.
  Session session_;
  std::array<std::uint8_t, 4096> read_buffer_{};
  std::array<std::uint8_t, 2048> write_buffer_{};
  bool writing_ = false;
  WallTime armed_ = WallTime::max();
  bool stopping_ = false;
  WallTime stop_deadline_;
  std::uint64_t coasts_obeyed_ = 0;
  std::uint64_t dropped_readings_ = 0, lease_expiries_ = 0;

  // Callers of any thread and the link's own meet here.
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<RadPerSec> wanted_speed_;
  std::uint64_t coasts_asked_ = 0;
  bool stop_asked_ = false;
  std::uint64_t coasts_confirmed_ = 0;  ///< every coast up to this one
  Session::State state_ = Session::State::connecting;
  bool ended_ = false;
  std::string failure_;
  Identity identity_;
  Counters counters_;

  std::atomic<std::int64_t> lease_end_ns_{0};  ///< steady_clock
  std::atomic<std::int64_t> newest_reading_ns_{0};
  std::atomic<bool> alive_{true};
  boost::lockfree::spsc_queue<Reading> queue_{16384};
  std::thread thread_;
};

}  // namespace kphi::iq
