// The driver and a simulated Ethernet Axia: other commands, other status bits, the same records.
#include <gtest/gtest.h>

#include <algorithm>

#include "drivers/netbox/wire/status.hpp"
#include "drivers/sim/script/faults.hpp"
#include "test/drivers/netbox_faults/joined.hpp"

namespace kphi::netbox::test {
namespace axia_test {

using namespace std::chrono_literals;

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
  j.run_until(2s);
  j.finish();
  EXPECT_EQ(j.disagreement(), "");
  EXPECT_EQ(records_per_datagram(j), 40u);
  EXPECT_EQ(j.wire().truth().starts, 1u);
}

TEST(Axia, ABufferOfOneBringsOneRecordInEachDatagram) {
  Joined j(axia(1), {}, 1);
  j.run_until(2s);
  j.finish();
  EXPECT_EQ(j.disagreement(), "");
  EXPECT_EQ(records_per_datagram(j), 1u);
}

TEST(Axia, TheNetBoxsBufferedCommandWouldBringNothing) {
  Manner manner = axia();
  Session wrong{StreamSettings{}};
  wrong.start(0s);
  wrong.advance(1s);
  Joined j(manner, {}, 1);
  std::array<std::uint8_t, 8> request;
  while (wrong.next_request(request)) j.box().receive(request, 9);
  EXPECT_FALSE(j.box().streaming());
}

TEST(Axia, ItsSaturationIsReadByItsOwnMap) {
  const sim::FaultEntry saturation{{"kind", "saturation"}, {"at_s", "1"}, {"for_s", "0.5"}, {"axes", "4"}};
  Joined j(axia(), {sim::fault_of(saturation)}, 1);
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
  const sim::FaultEntry reboot{{"kind", "reboot"}, {"at_s", "2.1"}, {"down_s", "0.2"}};
  Joined j(axia(), {sim::fault_of(reboot)}, 1);
  j.run_until(10s);
  j.finish();
  EXPECT_EQ(j.disagreement(), "");
  EXPECT_EQ(j.counters().reboots, 1u);
}

}  // namespace axia_test
}  // namespace kphi::netbox::test
