// The driver and a simulated Ethernet Axia: other commands, other status bits, the same records.
#include <gtest/gtest.h>

#include <algorithm>

#include "drivers/netbox/wire/status.hpp"
#include "test/drivers/netbox_faults/joined.hpp"
#include "test/drivers/sim/fault_words.hpp"

namespace kphi::netbox::test::axia_test {

using namespace std::chrono_literals;
using sim::test::fault_script;

Manner axia(int records_per_datagram = 40) {
  Manner manner;
  manner.records_per_datagram = records_per_datagram;
  manner.quirks.axia = true;
  return manner;
}

std::size_t records_per_datagram(Joined& joined) {
  const Counters& c = joined.counters();
  return c.datagrams == 0 ? 0 : static_cast<std::size_t>(c.received / c.datagrams);
}

TEST(Axia, MultiBlockBringsTheWholeBufferInEachDatagram) {
  Joined j(axia(), {}, 1);
  j.agree_until(2s);
  EXPECT_EQ(records_per_datagram(j), 40u);
  EXPECT_EQ(j.wire().truth().starts, 1u);
}

TEST(Axia, ABufferOfOneBringsOneRecordInEachDatagram) {
  Joined j(axia(1), {}, 1);
  j.agree_until(2s);
  EXPECT_EQ(records_per_datagram(j), 1u);
}

TEST(Axia, TheNetBoxsBufferedCommandWouldBringNothing) {
  Session wrong{StreamSettings{}};
  wrong.start(0s);
  wrong.advance(1s);
  Joined j(axia(), {}, 1);
  std::array<std::uint8_t, 8> request;
  while (wrong.next_request(request)) j.box().receive(request, 9);
  EXPECT_FALSE(j.box().streaming());
}

TEST(Axia, ItsSaturationIsReadByItsOwnMap) {
  Joined j(axia(), fault_script({"saturation at_s=1 for_s=0.5 axes=4"}), 1);
  j.run_until(2s);
  j.finish();
  const auto count = [&](Product product) {
    return std::count_if(j.out().begin(), j.out().end(),
                         [&](const LoadCellRecord& r) { return saturated(r.status, product); });
  };
  EXPECT_NEAR(static_cast<double>(count(Product::axia)), 3500 + 31, 2) << "an Axia's bit stays for 32 samples";
  EXPECT_EQ(count(Product::net_box), 0);
}

TEST(Axia, IsStartedAgainLikeANetBox) {
  Joined j(axia(), fault_script({"reboot at_s=2.1 down_s=0.2"}), 1);
  j.agree_until(10s);
  EXPECT_EQ(j.counters().reboots, 1u);
}

}  // namespace kphi::netbox::test::axia_test
