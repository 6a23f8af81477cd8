#include "daq/virtual/deterministic_air.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "daq/bench/air_source.hpp"
#include "drivers/ambient/ambient_worker.hpp"
#include "drivers/ambient/bme280.hpp"

namespace kphi::daq {
namespace {

constexpr Duration kFirstReading = std::chrono::seconds(10);
constexpr Duration kOldest = std::chrono::minutes(1);
constexpr Duration kAskAgain = std::chrono::milliseconds(1);
const ambient::Rhythm kRhythm;

}  // namespace

/// The drivers' transport straight into the simulated function.
class DirectUsb final : public usb::Transport {
 public:
  DirectUsb(sim::UsbFunction& function, const sim::UsbFaults& faults, ManualClock& time)
      : function_(function), faults_(faults), time_(time) {
    std::uint8_t number = 0;
    for (const sim::UsbInterfaceShape& shape : function.shape().interfaces) {
      usb::Interface found{number++, shape.class_code, shape.subclass, shape.protocol, {}};
      for (const sim::UsbEndpointShape& end : shape.endpoints)
        found.endpoints.push_back({end.address, kind_of(end), end.packet_bytes});
      interfaces_.push_back(std::move(found));
    }
  }
  const std::string& name() const noexcept override { return name_; }
  std::uint16_t vendor() const noexcept override { return function_.shape().vendor; }
  std::uint16_t product() const noexcept override { return function_.shape().product; }
  const std::vector<usb::Interface>& interfaces() const noexcept override { return interfaces_; }
  void claim(std::uint8_t) override {
    if (gone()) throw DeviceError(name_, "claim", "it is gone");
  }
  usb::Transfer control_in(const usb::Setup& setup, std::span<std::uint8_t> data, Timeout) noexcept override {
    if (gone()) return {usb::Outcome::gone};
    return put(function_.control(to_sim(setup, data.size()), {}), data);
  }
  usb::Transfer write(const usb::Endpoint& endpoint, std::span<const std::uint8_t> data, Timeout) noexcept override {
    if (gone()) return {usb::Outcome::gone};
    const bool stalled = function_.out(endpoint.address, data).kind == sim::UsbAnswer::Kind::stall;
    return stalled ? usb::Transfer{usb::Outcome::stalled} : usb::Transfer{usb::Outcome::done, data.size()};
  }
  usb::Transfer read(const usb::Endpoint& endpoint, std::span<std::uint8_t> data, Timeout timeout) noexcept override {
    for (const Instant give_up = time_.now() + timeout; time_.now() <= give_up; time_.advance(kAskAgain)) {
      if (gone()) return {usb::Outcome::gone};
      const sim::UsbAnswer answer = function_.in(endpoint.address, data.size());
      if (answer.kind != sim::UsbAnswer::Kind::nothing_yet) return put(answer, data);
    }
    return {usb::Outcome::timed_out};
  }
  usb::Outcome clear_halt(const usb::Endpoint& endpoint) noexcept override {
    function_.halt_cleared(endpoint.address);
    return usb::Outcome::done;
  }

 private:
  static usb::EndpointKind kind_of(const sim::UsbEndpointShape& end) {
    return end.attributes == 3 ? usb::EndpointKind::interrupt : usb::EndpointKind::bulk;
  }
  static sim::UsbSetup to_sim(const usb::Setup& setup, std::size_t length) {
    return {setup.request_type, setup.request, setup.value, setup.index, static_cast<std::uint16_t>(length)};
  }
  static usb::Transfer put(const sim::UsbAnswer& answer, std::span<std::uint8_t> data) {
    if (answer.kind == sim::UsbAnswer::Kind::stall) return {usb::Outcome::stalled};
    const std::size_t n = std::min(answer.bytes.size(), data.size());
    std::copy_n(answer.bytes.begin(), n, data.begin());
    return {usb::Outcome::done, n};
  }
  [[nodiscard]] bool gone() const { return faults_.active(sim::FaultKind::ambient_unplug); }

  sim::UsbFunction& function_;
  const sim::UsbFaults& faults_;
  ManualClock& time_;
  const std::string name_ = "simulated sensor of the air";
  std::vector<usb::Interface> interfaces_;
};

class DeterministicAir::Sensor {
 public:
  Sensor(sim::UsbFunction& function, const sim::UsbFaults& faults, ManualClock& time)
      : wire_(function, faults, time), bridge_(wire_, pause(time)), sensor_(bridge_, wire_.name(), pause(time)) {}
  [[nodiscard]] ambient::Air read() { return sensor_.read(); }

 private:
  static ambient::Mcp2221::Pause pause(ManualClock& time) {
    return [&time](std::chrono::microseconds wall) { time.advance(wall); };
  }
  DirectUsb wire_;
  ambient::Mcp2221 bridge_;
  ambient::Bme280Sensor sensor_;
};

DeterministicAir::DeterministicAir(const Clock& bench, const sim::TrueAir& air, sim::FaultScript faults,
                                   const profiles::AmbientConfig& config)
    : bench_(bench),
      config_(config),
      time_(bench.now()),
      faults_(time_, std::move(faults)),
      bridge_(faults_, "0001", sim::Bme280(air)),
      pause_(kRhythm.first_pause) {
  while (!newest_ && time_.now() < bench.now() + kFirstReading) {
    time_.set(std::max(time_.now(), next_));
    measure();
  }
  if (!newest_) throw DeviceError(failure_);
}

DeterministicAir::~DeterministicAir() = default;

void DeterministicAir::look() {
  if (bench_.now() < std::max(next_, time_.now())) return;
  time_.set(bench_.now());
  measure();
}

void DeterministicAir::measure() {
  try {
    if (!sensor_) sensor_ = std::make_unique<Sensor>(bridge_, faults_, time_);
    newest_ = ambient::density_of(as_placed(sensor_->read(), config_));
    newest_at_ = time_.now();
    pause_ = kRhythm.first_pause;
    next_ = time_.now() + kRhythm.between_readings;
  } catch (const DeviceError& error) {
    failure_ = error.what();
    sensor_.reset();
    next_ = time_.now() + pause_;
    pause_ = std::min(2 * pause_, Duration(kRhythm.longest_pause));
  }
}

std::optional<ambient::Density> DeterministicAir::density() const {
  if (!newest_ || bench_.now() - newest_at_ > kOldest) return std::nullopt;
  return newest_;
}

}  // namespace kphi::daq
