// A test on the virtual USB, skipped visibly where there is none.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>

#include "base/clock.hpp"
#include "drivers/sim/usb/function.hpp"
#include "test/drivers/sim_equipment/virtual_usb.hpp"
#include "test/refusal.hpp"

namespace kphi {

class OnVirtualBus : public testing::Test {
 protected:
  void SetUp() override {
    if (!sim::VirtualUsb::available()) GTEST_SKIP() << "needs LD_PRELOAD=libumockdev-preload.so.0 (package umockdev)";
    wire = std::make_unique<sim::VirtualUsb>();
  }

  /// From now on, so many times.
  void break_with(sim::FaultKind kind, std::uint64_t count = 1, Duration delay = {}, std::uint64_t size = 16) {
    sim::Fault fault;
    fault.kind = kind;
    fault.count = count;
    fault.delay = delay;
    fault.size = size;
    faults.set({fault});
  }

  SteadyClock clock;
  sim::UsbFaults faults{clock};
  std::unique_ptr<sim::VirtualUsb> wire;
};

/// Polls; false after ten seconds.
template <class Condition>
[[nodiscard]] bool eventually(Condition&& holds) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!holds()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace kphi
