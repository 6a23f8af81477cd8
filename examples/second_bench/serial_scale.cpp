#include "examples/second_bench/serial_scale.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "base/thread.hpp"
#include "daq/bench/device_records.hpp"
#include "daq/bench/offered_drivers.hpp"
#include "drivers/netbox/wire/status.hpp"

namespace kphi::second_bench {
namespace {

constexpr Duration kFirstLine = std::chrono::seconds(2);
constexpr Duration kSilent = std::chrono::milliseconds(500);  // forty conversions
constexpr Duration kLook = std::chrono::milliseconds(20);
constexpr std::int32_t kFullScale = (1 << 23) - 1;
constexpr std::size_t kMostWaiting = 8000;  // a hundred seconds that nobody takes

results::LoadCellScale scale_of(const profiles::BenchConfig& bench) {
  daq::DeviceSettings settings(*bench.load_cell);
  results::LoadCellScale scale;
  scale.counts_per_newton = settings.number("counts_per_newton", 1, 1e7);
  scale.range.at(static_cast<std::size_t>(bench.thrust_axis)) = settings.number("range_n", 0.1, 1e4);
  settings.finish();
  scale.sample_rate_hz = scale.device_rate_hz = bench.netbox.rate_hz;
  scale.saturation_bits = netbox::saturation_bits(netbox::Product::net_box);
  scale.serial = "hx711";
  return scale;
}

}  // namespace

SerialScale::SerialScale(const profiles::BenchConfig& bench, const Clock& clock)
    : clock_(clock),
      axis_(static_cast<std::size_t>(bench.thrust_axis)),
      scale_(scale_of(bench)),
      port_(bench.load_cell->device, bench.load_cell->baud),
      heard_(clock.now()),
      thread_(start_thread({"load cell", true}, [this] { listen(); })) {
  const auto heard_one = [this] {
    const std::lock_guard lock(mutex_);
    return last_ != 0;
  };
  for (const Instant give_up = clock.now() + kFirstLine; !heard_one() && clock.now() < give_up;)
    std::this_thread::sleep_for(kLook);
  if (heard_one()) return;
  quit();
  throw DeviceError("load cell " + port_.device(), "wait for a line", "none came within 2 s",
                    "look at the board's power, and at baud in the bench file");
}

SerialScale::~SerialScale() { quit(); }

void SerialScale::quit() noexcept {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  if (thread_.joinable()) thread_.join();
}

void SerialScale::listen() {
  std::array<std::uint8_t, 256> bytes{};
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (quit_) return;
    }
    try {
      if (!port_.wait(kLook)) continue;
      lines_.take({reinterpret_cast<const char*>(bytes.data()), port_.read(bytes)});
    } catch (const DeviceError& gone) {
      const std::lock_guard lock(mutex_);
      lost_ = gone.what();
      return;
    }
    while (const auto line = lines_.next('L', 2))
      add(static_cast<std::uint32_t>((*line)[0]),
          static_cast<std::int32_t>(std::clamp<std::int64_t>((*line)[1], -kFullScale - 1, kFullScale)));
  }
}

void SerialScale::add(std::uint32_t number, std::int32_t counts) {
  const std::lock_guard lock(mutex_);
  heard_ = clock_.now();
  account_.malformed = lines_.malformed();
  const bool rebooted = last_ != 0 && number <= last_;  // it counts from 1 again
  if (streams_ && rebooted) {
    ++account_.reboots;
    events_.push_back(daq::event_at(heard_, EventKind::rebooted, "the load cell's board restarted"));
  }
  if (streams_ && first_ == 0) first_ = number;
  if (streams_) {
    const std::uint32_t missed = account_.received == 0 || rebooted ? 0 : number - last_ - 1;
    account_.lost_network += missed;
    account_.expected += missed + 1;
    ++account_.received;
    LoadCellRecord record;
    record.counts.at(axis_) = counts;
    record.rdt_sequence = static_cast<std::uint32_t>(account_.expected);
    record.ft_sequence = number;
    record.arrival_ns = heard_.count();
    if (counts >= kFullScale || counts <= -kFullScale) record.status = scale_.saturation_bits;
    if (records_.size() < kMostWaiting) {
      records_.push_back(record);
    } else {
      --account_.received;
      ++account_.lost_host;
    }
  }
  last_ = number;
}

results::LoadCellScale SerialScale::start() {
  const std::lock_guard lock(mutex_);
  if (!lost_.empty()) throw DeviceError(lost_);
  records_.clear();
  events_.clear();
  account_ = {};
  first_ = 0;
  began_ = clock_.now();
  streams_ = true;
  return scale_;
}

void SerialScale::stop() noexcept {
  const std::lock_guard lock(mutex_);
  streams_ = false;
}

std::size_t SerialScale::take(std::span<LoadCellRecord> out) {
  const std::lock_guard lock(mutex_);
  return daq::move_oldest(records_, out);
}

std::vector<StreamEvent> SerialScale::take_events() {
  const std::lock_guard lock(mutex_);
  return std::exchange(events_, {});
}

Duration SerialScale::silent_for() const { return clock_.shrunk(clock_.now() - heard_); }

std::string SerialScale::failure() const {
  const std::lock_guard lock(mutex_);
  if (!lost_.empty()) return "load cell: " + lost_;
  if (!streams_ || silent_for() < kSilent) return {};
  return fmt::format("load cell: no line for {:.1f} s", to_seconds(silent_for()));
}

SampleAccount SerialScale::account() const {
  const std::lock_guard lock(mutex_);
  return account_;
}

StreamHealth SerialScale::health() const {
  const std::lock_guard lock(mutex_);
  StreamHealth health;
  const double seconds = to_seconds(heard_ - began_);
  if (seconds > 0) health.records_per_second = static_cast<double>(account_.received) / seconds;
  health.datagrams_per_second = health.records_per_second;
  return health;
}

}  // namespace kphi::second_bench
