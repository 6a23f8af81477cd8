#include "drivers/netbox/configuration/interfaces.hpp"

#include <gmock/gmock.h>

namespace kphi::netbox::interfaces_test {

using testing::HasSubstr;

const Interface kOffice{"eth0", 0x0A00020F, 24};  // 10.0.2.15
const Interface kBench{"eth1", 0xC0A80107, 24};   // 192.168.1.7

TEST(AdviceToReach, NamesThisComputersAddressesAndOneThatWouldDo) {
  EXPECT_EQ(advice_to_reach("192.168.1.1", {kOffice}),
            "this computer has 10.0.2.15/24 on eth0, none in the network of 192.168.1.1: give the card of its cable an "
            "address such as 192.168.1.100/24");
  EXPECT_THAT(advice_to_reach("192.168.1.100", {kOffice}), HasSubstr("such as 192.168.1.101/24")) << "not its own";
  EXPECT_THAT(advice_to_reach("192.168.1.1", {}), HasSubstr("no network address"));
}

TEST(AdviceToReach, IsNoneWhereACardIsInTheNetworkOrNobodyKnows) {
  EXPECT_EQ(advice_to_reach("192.168.1.1", {kOffice, kBench}), "");
  EXPECT_EQ(advice_to_reach("10.9.9.9", {{"tun0", 0x0A000001, 8}}), "");
  EXPECT_EQ(advice_to_reach("10.9.9.9", {{"all", 1, 0}}), "");
  for (const char* host : {"127.0.0.1", "netbox.lab", "", "192.168.1", "::1"}) EXPECT_EQ(advice_to_reach(host, {}), "");
}

TEST(Interfaces, AreThoseThatAreUpWithoutTheLoopback) {
  for (const Interface& card : interfaces()) {
    EXPECT_NE(card.address >> 24, 127u) << card.text();
    EXPECT_TRUE(card.is_near(card.address));
  }
}

}  // namespace kphi::netbox::interfaces_test
