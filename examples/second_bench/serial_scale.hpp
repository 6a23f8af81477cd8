// A load cell of one axis behind an HX711 on a small board, which prints each conversion: $L,<number>,<counts>*hh,
// counts of 24 bits with their sign. Numbers without a gap: a line that is lost is known. The converter has no clock of
// the host's and no filter that could be set.
#pragma once

#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "daq/bench/bench.hpp"
#include "drivers/serial/port.hpp"
#include "examples/second_bench/checked_lines.hpp"

namespace kphi::second_bench {

class SerialScale final : public daq::LoadCellLink {
 public:
  /// Opens the board and waits for its first line. Settings: counts_per_newton, range_n. Throws DeviceError.
  SerialScale(const profiles::BenchConfig& bench, const Clock& clock);
  ~SerialScale() override;
  [[nodiscard]] results::LoadCellScale scale() const override { return scale_; }
  results::LoadCellScale start() override;
  void stop() noexcept override;
  std::size_t take(std::span<LoadCellRecord> out) override;
  [[nodiscard]] std::vector<StreamEvent> take_events() override;
  [[nodiscard]] std::string failure() const override;
  [[nodiscard]] SampleAccount account() const override;
  [[nodiscard]] StreamHealth health() const override;

 private:
  void listen();
  void quit() noexcept;
  void add(std::uint32_t number, std::int32_t counts);
  [[nodiscard]] Duration silent_for() const;

  const Clock& clock_;
  const std::size_t axis_;
  results::LoadCellScale scale_;
  serial::Port port_;
  CheckedLines lines_;  ///< the thread's
  mutable std::mutex mutex_;
  std::vector<LoadCellRecord> records_;
  std::vector<StreamEvent> events_;
  SampleAccount account_;
  std::uint32_t first_ = 0, last_ = 0;  ///< numbers since start()
  Instant heard_{0}, began_{0};
  bool streams_ = false, quit_ = false;
  std::string lost_;    ///< why the port is gone
  std::thread thread_;  ///< last: it uses the members above
};

}  // namespace kphi::second_bench
