#include "drivers/sim/usb/mcp2221.hpp"

#include <algorithm>

namespace kphi::sim {
namespace {

using namespace std::chrono_literals;

constexpr std::uint8_t kHidOut = 0x03, kHidIn = 0x83;
constexpr std::size_t kChunk = 60;
constexpr Duration kBreath = 900us;

// Command codes (data sheet DS20005565, table 3-1).
constexpr std::uint8_t kStatusAndSet = 0x10, kGetData = 0x40, kGetSettings = 0x61, kWrite = 0x90, kReadRestart = 0x93,
                       kWriteNoStop = 0x94;
// Of the answers.
constexpr std::uint8_t kNotNow = 0x01, kNoSuchCommand = 0x02, kNoData = 127;
// States of the I²C engine.
constexpr std::uint8_t kIdle = 0x00, kOccupied = 0x01, kNoStart = 0x12, kNobody = 0x25, kOpenWrite = 0x45,
                       kAllRead = 0x55;

std::size_t length_in(std::span<const std::uint8_t> command) noexcept { return command[1] + 256u * command[2]; }

UsbShape shape_with(std::string serial) {
  return {0x04d8,
          0x00dd,
          "Microchip Technology Inc.",
          "MCP2221 USB-I2C/UART Combo",
          std::move(serial),
          {{0x02, 0x02, 0x01, {{0x81, 3, 8}}},
           {0x0A, 0x00, 0x00, {{0x82, 2, 16}, {0x02, 2, 16}}},
           {0x03, 0x00, 0x00, {{kHidIn, 3, 64}, {kHidOut, 3, 64}}}}};
}

}  // namespace

Mcp2221::Mcp2221(UsbFaults& faults, std::string serial, const Bme280& sensor)
    : shape_(shape_with(std::move(serial))), faults_(faults), sensor_(sensor) {}

void Mcp2221::set_air(const TrueAir& air) {
  const std::lock_guard lock(mutex_);
  sensor_.set_air(air);
}

BridgeTruth Mcp2221::truth() const {
  const std::lock_guard lock(mutex_);
  return truth_;
}

UsbAnswer Mcp2221::control(const UsbSetup&, std::span<const std::uint8_t>) { return {UsbAnswer::Kind::stall, {}}; }

UsbAnswer Mcp2221::out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) {
  const std::lock_guard lock(mutex_);
  if (endpoint != kHidOut) return {};  // the serial port, which leads nowhere
  if (bytes.size() != 64) {
    ++truth_.malformed;
    return {};
  }
  if (next_command_) return {UsbAnswer::Kind::nothing_yet, {}};
  Report command{};
  std::copy(bytes.begin(), bytes.end(), command.begin());
  ++truth_.commands;
  if (!answers_.empty()) {
    ++truth_.overlapped;
    next_command_ = command;
    return {};
  }
  if (faults_.now() - fetched_ < kBreath) ++truth_.hasty;
  const Report answer = apply(command);
  if (faults_.strikes(FaultKind::ambient_stall)) halted_ = true;
  if (faults_.strikes(FaultKind::ambient_no_reply)) return {};
  const auto late = faults_.strikes(FaultKind::ambient_late);
  answers_.push_back({answer, faults_.now() + (late ? late->delay : Duration{0})});
  return {};
}

UsbAnswer Mcp2221::in(std::uint8_t endpoint, std::size_t at_most) {
  const std::lock_guard lock(mutex_);
  if (endpoint != kHidIn) return {UsbAnswer::Kind::nothing_yet, {}};
  if (halted_) return {UsbAnswer::Kind::stall, {}};
  if (answers_.empty() || answers_.front().due > faults_.now()) return {UsbAnswer::Kind::nothing_yet, {}};
  const Report report = answers_.front().report;
  answers_.pop_front();
  fetched_ = faults_.now();
  if (next_command_) {
    answers_.push_back({apply(*next_command_), faults_.now()});
    next_command_.reset();
  }
  return {UsbAnswer::Kind::bytes,
          {report.begin(), report.begin() + static_cast<std::ptrdiff_t>(std::min(at_most, report.size()))}};
}

void Mcp2221::halt_cleared(std::uint8_t) {
  const std::lock_guard lock(mutex_);
  halted_ = false;
}

Duration Mcp2221::release_takes() {
  const auto slow = faults_.strikes(FaultKind::ambient_slow_close);
  return slow ? slow->delay : Duration{};
}

Mcp2221::Report Mcp2221::apply(const Report& command) {
  Report answer{};
  answer[0] = command[0];
  busy_ = faults_.strikes(FaultKind::ambient_busy).has_value();
  const auto warm = faults_.strikes(FaultKind::ambient_warm);
  sensor_.warm_by(warm ? warm->coil : 0);
  const std::uint8_t code = command[0];
  if (code == kStatusAndSet)
    status(command, answer);
  else if (code == kWrite || code == kWriteNoStop)
    write(command, answer);
  else if (code == kReadRestart)
    begin_read(command, answer);
  else if (code == kGetData)
    get_data(answer);
  else if (code != kGetSettings)
    answer[1] = kNoSuchCommand;
  return answer;
}

/// Table 3-3: cancel, set the speed, and how the engine is.
void Mcp2221::status(const Report& command, Report& answer) {
  if (command[2] == 0x10) {
    answer[2] = engine() == kIdle ? 0x11 : 0x10;
    state_ = kIdle;
    free_at_ = faults_.now();
    nack_ = false;
  }
  if (command[3] == 0x20) {
    const bool settable = engine() == kIdle;
    answer[3] = settable ? 0x20 : 0x21;
    answer[4] = command[4];
    if (settable) divider_ = command[4];
  }
  answer[8] = engine();
  answer[20] = nack_ ? 0x40 : 0x00;
}

/// Up to 60 bytes: one report.
void Mcp2221::write(const Report& command, Report& answer) {
  if (!takes_transfer(answer) || !addressed(command[3])) return;
  const std::size_t count = std::min(kChunk, length_in(command));
  occupy(count + 1);
  sensor_.write(std::span(command).subspan(4, count), faults_.now());
  state_ = command[0] == kWriteNoStop ? kOpenWrite : kIdle;
}

void Mcp2221::begin_read(const Report& command, Report& answer) {
  if (!takes_transfer(answer)) return;
  to_read_ = std::min(kChunk, length_in(command));
  if (to_read_ == 0) ++truth_.malformed;
  if (!addressed(command[3])) return;
  state_ = kAllRead;
  occupy(1 + to_read_);
}

void Mcp2221::get_data(Report& answer) {
  answer[2] = engine();
  answer[3] = kNoData;
  if (answer[2] != kAllRead) return;
  for (std::size_t i = 0; i < to_read_; ++i) answer[4 + i] = sensor_byte();
  answer[3] = static_cast<std::uint8_t>(to_read_);
  state_ = kIdle;
}

/// A transfer may begin when the engine is idle, or holds the bus after a write without a stop.
bool Mcp2221::takes_transfer(Report& answer) {
  const std::uint8_t now = engine();
  if (now == kIdle || now == kOpenWrite) return true;
  answer[1] = kNotNow;
  answer[2] = now;
  return false;
}

/// Seven bits of address; the lowest bit of a read's may be either. An absent acknowledgement shows later only.
bool Mcp2221::addressed(std::uint8_t address_byte) {
  if (faults_.strikes(FaultKind::ambient_stuck_bus)) {
    state_ = kNoStart;
    return false;
  }
  if (address_byte >> 1 == sensor_.address() && !faults_.strikes(FaultKind::ambient_nack)) return true;
  ++truth_.nacks;
  nack_ = true;
  state_ = kNobody;
  occupy(1);
  return false;
}

/// Nine bits for each byte at the set speed.
void Mcp2221::occupy(std::size_t bytes) {
  const double bit_s = (divider_ + 3) / 12e6;
  free_at_ = std::max(free_at_, faults_.now()) + from_seconds(9.0 * static_cast<double>(bytes) * bit_s);
}

std::uint8_t Mcp2221::engine() const { return busy_ || faults_.now() < free_at_ ? kOccupied : state_; }

std::uint8_t Mcp2221::sensor_byte() {
  const std::uint8_t at = sensor_.pointer();
  const std::uint8_t value = sensor_.read(faults_.now());
  const auto fault = faults_.strikes(FaultKind::ambient_reads_as, at);
  return fault ? fault->value : value;
}

}  // namespace kphi::sim
