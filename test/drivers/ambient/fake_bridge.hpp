// An MCP2221A with a BME280's registers behind it, as a transport: written from the tables of the two manuals, by hand,
// for tests of the drivers that sit on it. Not the simulator: that one hangs on a virtual bus.
#pragma once

#include <deque>
#include <functional>
#include <map>

#include "drivers/usb/bus.hpp"

namespace kphi::ambient {

class FakeBridge final : public usb::Transport {
 public:
  FakeBridge() {
    registers[0xD0] = 0x60;
    const std::uint8_t first[] = {0x70, 0x6B, 0x43, 0x67, 0x18, 0xFC, 0x7D, 0x8E, 0x43, 0xD6, 0xD0, 0x0B,
                                  0x27, 0x0B, 0x8C, 0x00, 0xF9, 0xFF, 0x8C, 0x3C, 0xF8, 0xC6, 0x70, 0x17};
    for (std::uint8_t i = 0; i < 24; ++i) registers[0x88 + i] = first[i];
    registers[0xA1] = 75;
    const std::uint8_t second[] = {0x6A, 0x01, 0x00, 0x14, 0x26, 0x03, 0x1E};
    for (std::uint8_t i = 0; i < 7; ++i) registers[0xE1 + i] = second[i];
    const std::uint8_t reset[] = {0x80, 0, 0, 0x80, 0, 0, 0x80, 0};
    for (std::uint8_t i = 0; i < 8; ++i) registers[0xF7 + i] = reset[i];
  }

  std::uint8_t sensor_address = 0x76;
  std::map<int, std::uint8_t> registers;
  std::vector<std::vector<std::uint8_t>> commands;  ///< as they came, without trailing zeros
  std::vector<std::pair<int, int>> writes;          ///< register, value
  bool claimed = false;
  /// May change or drop the answer to a command: true = drop it.
  std::function<bool(std::vector<std::uint8_t>& answer)> spoil = [](auto&) { return false; };
  std::deque<std::vector<std::uint8_t>> waiting;
  usb::Outcome next_write = usb::Outcome::done;
  int busy = 0;  ///< so many requests for data come too early

  const std::string& name() const noexcept override { return name_; }
  std::uint16_t vendor() const noexcept override { return 0x04d8; }
  std::uint16_t product() const noexcept override { return 0x00dd; }
  const std::vector<usb::Interface>& interfaces() const noexcept override { return interfaces_; }
  void claim(std::uint8_t number) override { claimed = number == 2; }
  usb::Transfer control_in(const usb::Setup&, std::span<std::uint8_t>, Timeout) noexcept override {
    return {usb::Outcome::stalled};
  }
  usb::Outcome clear_halt(const usb::Endpoint&) noexcept override { return usb::Outcome::done; }

  usb::Transfer write(const usb::Endpoint& endpoint, std::span<const std::uint8_t> data, Timeout) noexcept override {
    if (next_write != usb::Outcome::done) return {next_write};
    if (endpoint.address != 0x03 || data.size() != 64) return {usb::Outcome::stalled};
    std::vector<std::uint8_t> command(data.begin(), data.end());
    while (!command.empty() && command.back() == 0) command.pop_back();
    commands.push_back(command);
    std::vector<std::uint8_t> answer = answer_to(data);
    if (!spoil(answer)) waiting.push_back(answer);
    return {usb::Outcome::done, 64};
  }
  usb::Transfer read(const usb::Endpoint& endpoint, std::span<std::uint8_t> data, Timeout) noexcept override {
    if (endpoint.address != 0x83) return {usb::Outcome::stalled};
    if (waiting.empty()) return {usb::Outcome::timed_out};
    const auto answer = waiting.front();
    waiting.pop_front();
    std::copy(answer.begin(), answer.end(), data.begin());
    return {usb::Outcome::done, answer.size()};
  }

 private:
  std::vector<std::uint8_t> answer_to(std::span<const std::uint8_t> c) {
    std::vector<std::uint8_t> a(64, 0);
    a[0] = c[0];
    switch (c[0]) {
      case 0x10:
        if (c[2] == 0x10) nack_ = false, state_ = 0;
        if (c[3] == 0x20) a[3] = 0x20, a[4] = c[4];
        a[8] = nack_ ? 0x25 : state_;
        a[20] = nack_ ? 0x40 : 0;
        break;
      case 0x90:
      case 0x94:
        nack_ = (c[3] >> 1) != sensor_address;
        state_ = c[0] == 0x94 ? 0x45 : 0;
        if (!nack_) take(c.subspan(4, c[1]));
        break;
      case 0x93:
        nack_ = (c[3] >> 1) != sensor_address;
        wanted_ = static_cast<std::size_t>(c[1] | c[2] << 8);
        break;
      case 0x40: {
        if (busy > 0) {
          --busy;
          a[2] = 0x01, a[3] = 127;
          break;
        }
        a[2] = nack_ ? 0x25 : 0x55;
        const std::size_t n = std::min<std::size_t>(wanted_, 60);
        a[3] = nack_ ? 127 : static_cast<std::uint8_t>(n);
        for (std::size_t i = 0; i < n && !nack_; ++i) a[4 + i] = registers[pointer_++];
        wanted_ -= nack_ ? 0 : n;
        state_ = 0;
        break;
      }
      default:
        a[1] = 0x02;
    }
    return a;
  }

  void take(std::span<const std::uint8_t> bytes) {
    pointer_ = bytes[0];
    for (std::size_t i = 1; i < bytes.size(); i += 2) {
      writes.emplace_back(bytes[i - 1], bytes[i]);
      registers[bytes[i - 1]] = bytes[i];
      if (bytes[i - 1] == 0xF2) humidity_ = bytes[i];
      if (bytes[i - 1] == 0xF4 && (bytes[i] & 3) == 1) measure();
    }
  }
  void measure() {
    const std::uint8_t data[] = {0x65, 0x5A, 0xC0, 0x7E, 0xED, 0x00, 0x78, 0x00};
    for (int i = 0; i < 6; ++i) registers[0xF7 + i] = data[i];
    if ((humidity_ & 7) != 0)
      for (int i = 6; i < 8; ++i) registers[0xF7 + i] = data[i];
  }

  std::string name_ = "USB device 04d8:00dd, serial 0001";
  std::vector<usb::Interface> interfaces_{
      {0, 0x02, 0x02, 0x01, {{0x81, usb::EndpointKind::interrupt, 8}}},
      {1, 0x0A, 0, 0, {{0x82, usb::EndpointKind::bulk, 16}, {0x02, usb::EndpointKind::bulk, 16}}},
      {2, 0x03, 0, 0, {{0x83, usb::EndpointKind::interrupt, 64}, {0x03, usb::EndpointKind::interrupt, 64}}}};
  std::uint8_t state_ = 0, humidity_ = 0;
  bool nack_ = false;
  int pointer_ = 0;
  std::size_t wanted_ = 0;
};

/// No test waits.
inline void no_pause(std::chrono::microseconds) {}

}  // namespace kphi::ambient
