#include "drivers/iq/exchange/telemetry.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "test/drivers/iq/wire.hpp"

namespace kphi::iq {
namespace {

TEST(Settings, ThatMakeNoSenseAreRefused) {
  for (const auto& spoil : std::vector<std::function<void(Settings&)>>{
           [](Settings& s) { s.module_id = 63; }, [](Settings& s) { s.module_id = -1; },
           [](Settings& s) { s.telemetry_hz = 0; }, [](Settings& s) { s.telemetry_hz = std::nan(""); },
           [](Settings& s) { s.module_timeout_s = 0; }, [](Settings& s) { s.credit_bytes = 17; }}) {
    Settings settings;
    spoil(settings);
    EXPECT_THROW(Session{settings}, std::invalid_argument);
  }
}

}  // namespace
}  // namespace kphi::iq
