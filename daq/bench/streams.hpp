// Samples, readings and events of a bench while a run is recorded, oldest first, and the queue that passes them on.
#pragma once

#include <algorithm>
#include <boost/lockfree/spsc_queue.hpp>
#include <span>
#include <vector>

#include "daq/bench/bench.hpp"

namespace kphi::daq {

class Streams {
 public:
  virtual ~Streams() = default;
  virtual std::size_t take(std::span<results::LoadCellRecord> out) = 0;
  virtual std::size_t take(std::span<results::MotorReading> out) = 0;
  virtual std::size_t take(std::span<results::SupplyReading> out) = 0;
  /// Events of load cell and motor.
  [[nodiscard]] virtual std::vector<results::StreamEvent> take_events() = 0;
};

/// The devices' own queues.
class BenchStreams final : public Streams {
 public:
  explicit BenchStreams(Bench& bench) : bench_(bench) {}
  std::size_t take(std::span<results::LoadCellRecord> out) override { return bench_.load_cell().take(out); }
  std::size_t take(std::span<results::MotorReading> out) override { return bench_.motor().take(out); }
  std::size_t take(std::span<results::SupplyReading> out) override {
    return bench_.supply() != nullptr ? bench_.supply()->take(out) : 0;
  }
  [[nodiscard]] std::vector<results::StreamEvent> take_events() override {
    std::vector<results::StreamEvent> events = bench_.load_cell().take_events();
    for (auto& event : bench_.motor().take_events()) events.push_back(std::move(event));
    return events;
  }

 private:
  Bench& bench_;
};

template <class T>
class Relay {
 public:
  Relay(std::size_t capacity, std::size_t at_once) : queue_(capacity), batch_(at_once) {}

  /// Producer. `take(span)` fills it and returns how many; `inspect(span)` sees them before they are pushed. True:
  /// something moved.
  template <class Take, class Inspect>
  bool move(Take&& take, Inspect&& inspect) {
    for (bool moved = false;; moved = true) {
      const std::span<T> room(batch_.data(), std::min(batch_.size(), queue_.write_available()));
      const std::size_t n = room.empty() ? 0 : take(room);
      if (n == 0) return moved;
      inspect(std::span<const T>(room.first(n)));
      queue_.push(batch_.data(), n);
    }
  }
  /// Consumer.
  std::size_t take(std::span<T> out) { return queue_.pop(out.data(), out.size()); }

 private:
  boost::lockfree::spsc_queue<T> queue_;
  std::vector<T> batch_;
};

}  // namespace kphi::daq
