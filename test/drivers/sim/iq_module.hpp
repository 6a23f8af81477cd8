// A simulated module with perfect sensors and a perfect clock, told frame by frame.
#pragma once

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include "drivers/sim/iq/device.hpp"
#include "test/drivers/sim/hex.hpp"

namespace kphi::sim::test {

class ExactModule : public ::testing::Test {
 protected:
  static IqSettings exact() {
    IqSettings settings;
    settings.oscillator_gain = 0;
    settings.sensors.perfect = true;
    return settings;
  }
  void restart() { device = IqDevice(settings, state); }
  /// What the module answers to these bytes, as hex.
  std::string tell(std::string_view spelt, Instant now = Instant{0}) {
    device.output().clear();
    device.receive(bytes(spelt), now);
    return hex(device.output());
  }
  /// The same for one frame; `access` is id * 4 + code.
  std::string send(std::uint8_t type, std::uint8_t sub, int access, std::string_view data = "",
                   Instant now = Instant{0}) {
    std::vector<std::uint8_t> frame;
    append_iq_frame(frame, type, sub, static_cast<std::uint8_t>(access), bytes(data));
    device.output().clear();
    device.receive(frame, now);
    return hex(device.output());
  }
  /// Data of the answer to a get.
  std::string get(std::uint8_t type, std::uint8_t sub, Instant now = Instant{0}) {
    const std::string answer = send(type, sub, 0, "", now);
    return answer.size() < 21 ? "" : answer.substr(15, answer.size() - 21);
  }
  void set_float(std::uint8_t type, std::uint8_t sub, float value, Instant now = Instant{0}) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    std::vector<std::uint8_t> data, frame;
    for (int shift = 0; shift < 32; shift += 8) data.push_back(static_cast<std::uint8_t>(bits >> shift));
    append_iq_frame(frame, type, sub, 1, data);
    device.receive(frame, now);
  }
  [[nodiscard]] float number(std::uint8_t type, std::uint8_t sub, Instant now = Instant{0}) {
    const auto data = bytes(get(type, sub, now));
    if (data.size() != 4) return std::nanf("");
    return std::bit_cast<float>(static_cast<std::uint32_t>(data[0] | data[1] << 8 | data[2] << 16) |
                                static_cast<std::uint32_t>(data[3]) << 24);
  }
  /// Ticks of a millisecond: what the module does by itself.
  void run(Instant from, Instant to) {
    for (Instant at = from; at <= to; at += std::chrono::milliseconds(1)) {
      for (int i = 0; i < 7; ++i) device.advance(at);
    }
  }

  MotorState state;
  IqSettings settings = exact();
  IqDevice device{settings, state};
};

}  // namespace kphi::sim::test
