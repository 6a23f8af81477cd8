// A test on the virtual USB, skipped visibly where there is none.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <memory>

#include "base/clock.hpp"
#include "drivers/sim/usb/function.hpp"
#include "test/drivers/sim_equipment/virtual_usb.hpp"
#include "test/refusal.hpp"
#include "test/soon.hpp"

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

using test::soon;

}  // namespace kphi
