// Samples, readings and events of a bench while a run is recorded, oldest first. One thread takes all of them.
#pragma once

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
  /// Of load cell and motor.
  [[nodiscard]] virtual std::vector<results::StreamEvent> take_events() = 0;
};

/// From the devices' own queues.
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

}  // namespace kphi::daq
