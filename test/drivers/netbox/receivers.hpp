// The driver beside the least that can receive the same stream: a loop of recvmmsg that swaps bytes. What each costs
// per record, in CPU time of its receiving thread.
#pragma once

#include <fmt/format.h>
#include <sys/socket.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <boost/endian/conversion.hpp>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <vector>

#include "drivers/netbox/receive/load_cell.hpp"
#include "test/drivers/netbox/box_process.hpp"

namespace kphi::netbox::test {

inline double cpu_seconds(clockid_t clock = CLOCK_THREAD_CPUTIME_ID) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Of another thread of this process (Linux: how the kernel writes a thread's id into a clock's).
inline clockid_t cpu_clock_of(int thread_id) {
  constexpr unsigned kScheduler = 2, kOfThread = 4;
  return static_cast<clockid_t>(~static_cast<unsigned>(thread_id) << 3 | kOfThread | kScheduler);
}

inline std::set<int> threads_of_this_process() {
  std::set<int> ids;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task"))
    ids.insert(std::stoi(entry.path().filename()));
  return ids;
}

struct Cost {
  std::uint64_t records = 0, lost = 0;
  double wall_s = 0;
  double receiver_cpu_s = 0;  ///< of the receiving thread
  double consumer_cpu_s = 0;  ///< of the thread that takes
  std::uint64_t wakeups = 0;  ///< of the receiving thread: how often it has slept
  double receiver_ns() const { return 1e9 * receiver_cpu_s / static_cast<double>(records); }
  double both_ns() const { return 1e9 * (receiver_cpu_s + consumer_cpu_s) / static_cast<double>(records); }
  double rate_hz() const { return static_cast<double>(records) / wall_s; }
  double wakeups_per_record() const { return static_cast<double>(wakeups) / static_cast<double>(records); }
};

/// How often a thread of this process has gone to sleep by itself.
inline std::uint64_t sleeps_of(int thread_id) {
  std::ifstream status(fmt::format("/proc/self/task/{}/status", thread_id));
  for (std::string word; status >> word;) {
    std::uint64_t count = 0;
    if (word == "voluntary_ctxt_switches:" && status >> count) return count;
  }
  return 0;
}

/// Receives a stream and swaps its bytes, nothing else: no stamps, no account, no queue. Sleeps `sleep_time` after each
/// wake-up, so that datagrams gather.
class BareReceiver {
 public:
  BareReceiver(const Ports& ports, bool buffered) : socket_("127.0.0.1", ports.rdt) {
    const int off = 0;
    setsockopt(socket_.descriptor(), SOL_SOCKET, SO_TIMESTAMPNS, &off, sizeof off);
    setsockopt(socket_.descriptor(), SOL_SOCKET, SO_RXQ_OVFL, &off, sizeof off);
    for (unsigned i = 0; i < kBatch; ++i) {
      vectors_[i] = {bytes_[i].data(), bytes_[i].size()};
      headers_[i].msg_hdr.msg_iov = &vectors_[i];
      headers_[i].msg_hdr.msg_iovlen = 1;
    }
    request(buffered ? 3 : 2);
  }
  ~BareReceiver() { request(0); }

  Cost run(double seconds, std::chrono::nanoseconds sleep_time) {
    static_cast<void>(drain(sleep_time));  // the first comes after the start only
    Cost cost;
    const std::uint32_t first = newest_rdt();
    const double cpu = cpu_seconds(), wall = cpu_seconds(CLOCK_MONOTONIC);
    while (cost.wall_s < seconds) {
      cost.records += drain(sleep_time);
      cost.wall_s = cpu_seconds(CLOCK_MONOTONIC) - wall;
    }
    cost.receiver_cpu_s = cpu_seconds() - cpu;
    cost.lost = newest_rdt() - first - cost.records;
    return cost;
  }

 private:
  static constexpr unsigned kBatch = 64;
  void request(std::uint8_t command) {
    const std::array<std::uint8_t, 8> bytes{0x12, 0x34, 0, command, 0, 0, 0, 0};
    socket_.send(bytes);
  }
  std::uint64_t drain(std::chrono::nanoseconds sleep_time) {
    pollfd readable{socket_.descriptor(), POLLIN, 0};
    poll(&readable, 1, 1000);
    if (sleep_time.count() > 0) {
      const timespec time{0, sleep_time.count()};
      nanosleep(&time, nullptr);
    }
    std::uint64_t records = 0;
    for (int count = kBatch; count == kBatch;) {
      count = recvmmsg(socket_.descriptor(), headers_.data(), kBatch, MSG_DONTWAIT, nullptr);
      for (int i = 0; i < count; ++i) records += swap(static_cast<std::size_t>(i));
    }
    return records;
  }
  std::size_t swap(std::size_t slot) {
    const std::size_t words = headers_[slot].msg_len / 4;
    for (std::size_t w = 0; w < words; ++w) words_[slot][w] = boost::endian::load_big_u32(bytes_[slot].data() + 4 * w);
    if (words >= 9) newest_ = &words_[slot][words - 9];
    return words / 9;
  }
  std::uint32_t newest_rdt() const { return newest_ ? *newest_ : 0; }

  UdpSocket socket_;
  std::array<std::array<std::uint8_t, 1500>, kBatch> bytes_{};
  std::array<std::array<std::uint32_t, 9 * kMaxRecords + 15>, kBatch> words_{};
  std::array<iovec, kBatch> vectors_{};
  std::array<mmsghdr, kBatch> headers_{};
  const std::uint32_t* newest_ = nullptr;
};

/// The driver with its consumer: this thread.
class Driver {
 public:
  enum class Consumer { waits, polls };  ///< polls: takes every 5 ms, as a recorder does

  Driver(const Ports& ports, const Clock& clock) : clock_(clock), cell_({"127.0.0.1", ports.rdt, ports.http}, clock) {
    const std::set<int> before = threads_of_this_process();
    cell_.start();
    for (const int id : threads_of_this_process())
      if (before.count(id) == 0) receiver_ = id;
  }
  ~Driver() { cell_.stop(); }

  Cost run(double seconds, Consumer consumer) {
    take(consumer);
    Cost cost;
    ages_.clear();
    const std::uint64_t sleeps = sleeps_of(receiver_);
    const Counters begun = cell_.counters();
    const double cpu = cpu_seconds(cpu_clock_of(receiver_)), own = cpu_seconds(), wall = cpu_seconds(CLOCK_MONOTONIC);
    while (cpu_seconds(CLOCK_MONOTONIC) - wall < seconds) take(consumer);
    cost.wall_s = cpu_seconds(CLOCK_MONOTONIC) - wall;
    cost.receiver_cpu_s = cpu_seconds(cpu_clock_of(receiver_)) - cpu;
    cost.consumer_cpu_s = cpu_seconds() - own;
    cost.wakeups = sleeps_of(receiver_) - sleeps;
    const Counters ended = cell_.counters();
    cost.records = ended.received - begun.received;
    cost.lost = ended.lost_network + ended.lost_host + ended.queue_overflows + ended.late;
    return cost;
  }
  LoadCell& cell() { return cell_; }
  /// Bench time from the kernel's stamp to the consumer's hand that so many of 100 records of the last run did not
  /// exceed.
  Duration age(std::size_t percentile) {
    if (ages_.empty()) return Duration{0};
    const auto at = ages_.begin() + static_cast<std::ptrdiff_t>((ages_.size() - 1) * percentile / 100);
    std::nth_element(ages_.begin(), at, ages_.end());
    return *at;
  }
  bool keep_ages = false;
  bool in_order = true;  ///< each record taken followed the one before

 private:
  void take(Consumer consumer) {
    if (consumer == Consumer::waits) {
      if (!cell_.wait(std::chrono::milliseconds(100))) return;
    } else {
      usleep(5000);  // a recorder's period; what it costs is measured
    }
    while (const std::size_t count = cell_.take(records_)) {
      for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t rdt = records_[i].rdt_sequence;
        in_order &= taken_++ == 0 || rdt == last_rdt_ + 1;
        last_rdt_ = rdt;
      }
      if (!keep_ages) continue;
      const Instant now = clock_.now();
      for (std::size_t i = 0; i < count; ++i) ages_.push_back(now - records_[i].arrival());
    }
  }

  const Clock& clock_;
  LoadCell cell_;
  int receiver_ = 0;
  std::vector<LoadCellRecord> records_ = std::vector<LoadCellRecord>(4096);
  std::vector<Duration> ages_;
  std::uint64_t taken_ = 0;
  std::uint32_t last_rdt_ = 0;
};

inline constexpr double kHasteHz = 200'000;
inline constexpr std::chrono::nanoseconds kBareNap = std::chrono::milliseconds(2);  // as the driver gathers

struct Pair {
  Cost bare, driver;
  double ratio() const { return driver.receiver_ns() / bare.receiver_ns(); }
  double ratio_with_consumer() const { return driver.both_ns() / bare.receiver_ns(); }
};

/// One pair at 200 000 records per second; nothing when the generator missed its rate, or the machine starved either.
inline std::optional<Pair> measure_pair(const BoxProcess& box, bool buffered, double seconds) {
  Pair pair;
  {
    BareReceiver bare(box.ports(), buffered);
    pair.bare = bare.run(seconds, kBareNap);
  }
  const SteadyClock clock(kHasteHz / 7000);
  Driver driver(box.ports(), clock);
  pair.driver = driver.run(seconds, Driver::Consumer::waits);
  const auto kept = [](const Cost& cost) { return std::abs(cost.rate_hz() / kHasteHz - 1) < 0.03; };
  if (!kept(pair.bare) || !kept(pair.driver)) return std::nullopt;
  return pair;
}

inline double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0 : values[values.size() / 2];
}

}  // namespace kphi::netbox::test
