// The simulated box on real sockets of loopback, and a consumer of the driver's records that remembers what it saw.
#pragma once

#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "drivers/netbox/receive/load_cell.hpp"
#include "drivers/sim/bench_server.hpp"
#include "test/drivers/sim/fault_words.hpp"
#include "test/soon.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::netbox::test {

inline constexpr std::chrono::seconds kPatience{20};

using kphi::test::soon;

/// Free ports, a folder of its own, a thread of its own.
class LiveBox {
 public:
  struct Manner {
    double rate_hz = 7000;
    int records_per_datagram = 40;
    double time_scale = 1;
    std::vector<std::string> faults = {};  ///< "loss at_s=1 for_s=2 p=0.1"
    sim::NetBoxQuirks quirks = {};
  };

  explicit LiveBox(const Manner& manner) : server_(settings(manner)), thread_([this] { server_.run(); }) {}
  ~LiveBox() { stop(); }
  LiveBox(const LiveBox&) = delete;
  LiveBox& operator=(const LiveBox&) = delete;

  [[nodiscard]] const sim::Addresses& addresses() const { return server_.addresses(); }
  [[nodiscard]] Address address() const { return {addresses().host, addresses().rdt_port, addresses().http_port}; }
  /// What truly happened; the box is gone then.
  const sim::WireTruth& stop() {
    if (thread_.joinable()) {
      server_.request_stop();
      thread_.join();
    }
    return server_.truth();
  }

 private:
  [[nodiscard]] sim::ServerSettings settings(const Manner& manner) const {
    sim::ServerSettings settings;
    settings.bench.time_scale = manner.time_scale;
    settings.bench.netbox.rate_hz = manner.rate_hz;
    settings.bench.netbox.records_per_datagram = manner.records_per_datagram;
    settings.bench.netbox.quirks = manner.quirks;
    settings.bench.faults = sim::test::fault_script(manner.faults);
    settings.bench.keep = sim::FaultInjector::Keep::samples;
    settings.control = (folder_.path() / "control").string();
    return settings;
  }

  kphi::test::TemporaryFolder folder_;
  sim::Server server_;
  std::thread thread_;
};

/// Takes whatever comes and checks that it is in order. Has a state and can be neither copied nor moved.
class Consumer {
 public:
  explicit Consumer(LoadCell& cell) : cell_(cell), batch_(4096) {}
  Consumer(const Consumer&) = delete;
  Consumer& operator=(const Consumer&) = delete;

  /// Until `enough` records were taken in all; false when they do not come in time.
  bool take_until(std::uint64_t enough) {
    return take_while([&] { return taken_ < enough; });
  }
  template <class Condition>
  bool take_while(Condition condition) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (condition()) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      if (cell_.wait(std::chrono::milliseconds(20))) take_what_waits();
    }
    return true;
  }
  void take_what_waits() {
    while (const std::size_t count = cell_.take(batch_)) {
      for (std::size_t i = 0; i < count; ++i) see(batch_[i]);
    }
  }

  [[nodiscard]] std::uint64_t taken() const { return taken_; }
  [[nodiscard]] std::uint64_t out_of_order() const { return out_of_order_; }
  /// Of ft_sequence, beyond one stride from record to record.
  [[nodiscard]] std::uint64_t samples_missing() const { return samples_missing_; }
  [[nodiscard]] std::uint32_t first_rdt() const { return first_rdt_; }
  [[nodiscard]] std::uint32_t last_rdt() const { return last_.rdt_sequence; }

 private:
  void see(const LoadCellRecord& record) {
    if (taken_++ == 0) {
      first_rdt_ = record.rdt_sequence;
    } else {
      const auto advance = static_cast<std::int32_t>(record.ft_sequence - last_.ft_sequence);
      const auto stride = static_cast<std::int32_t>(cell_.configuration().divisor);
      if (advance <= 0) ++out_of_order_;
      if (advance > stride) samples_missing_ += static_cast<std::uint64_t>(advance - stride);
    }
    last_ = record;
  }

  LoadCell& cell_;
  std::vector<LoadCellRecord> batch_;
  std::uint64_t taken_ = 0, out_of_order_ = 0, samples_missing_ = 0;
  std::uint32_t first_rdt_ = 0;
  LoadCellRecord last_;
};

/// A box, the driver at its speed, and its consumer.
struct LiveStream {
  explicit LiveStream(const LiveBox::Manner& manner)
      : box(manner), clock(manner.time_scale), cell(box.address(), clock), consumer(cell) {}

  /// False when they do not come in time.
  bool start_and_take(std::uint64_t records) {
    cell.start();
    return consumer.take_until(records);
  }
  LiveBox box;
  const SteadyClock clock;
  LoadCell cell;
  Consumer consumer;
};

/// Kinds of the events until one of `last` comes, that one included; all so far when it does not come in time.
inline std::vector<EventKind> events_until(LoadCell& cell, EventKind last) {
  std::vector<EventKind> kinds;
  (void)soon([&] {
    for (const Event& event : cell.take_events()) kinds.push_back(event.kind);
    return !kinds.empty() && kinds.back() == last;
  });
  return kinds;
}

}  // namespace kphi::netbox::test
