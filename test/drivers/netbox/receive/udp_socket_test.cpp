#include "drivers/netbox/receive/udp_socket.hpp"

#include <gtest/gtest.h>

#include "base/clock.hpp"
#include "base/error.hpp"
#include "test/drivers/netbox/fake_box.hpp"
#include "test/refusal.hpp"

namespace kphi::netbox::udp_socket_test {

using namespace std::chrono_literals;
using test::LoopbackSocket;

constexpr std::chrono::nanoseconds kSingle(1'000'000'000 / 7000), kForty = 40 * kSingle;

class UdpSocketTest : public testing::Test {
 protected:
  UdpSocketTest() {
    socklen_t length = sizeof own;
    getsockname(socket.descriptor(), reinterpret_cast<sockaddr*>(&own), &length);
  }
  void send_from(const LoopbackSocket& sender, std::size_t size) {
    const std::string bytes(size, 'x');
    ASSERT_EQ(sendto(sender.descriptor(), bytes.data(), size, 0, reinterpret_cast<sockaddr*>(&own), sizeof own),
              static_cast<ssize_t>(size));
  }

  LoopbackSocket box{SOCK_DGRAM};
  UdpSocket socket{"127.0.0.1", box.port()};
  sockaddr_in own{};
};

TEST_F(UdpSocketTest, ReceivesNothingWhereNothingWaits) { EXPECT_TRUE(socket.receive().empty()); }

TEST_F(UdpSocketTest, TakesAllThatWaitsWithItsSizesAndStamps) {
  timespec before{};
  clock_gettime(CLOCK_REALTIME, &before);
  for (const std::size_t size : {36u, 0u, 1440u, 1476u}) send_from(box, size);
  const auto datagrams = socket.receive();
  std::vector<std::size_t> sizes;
  for (const UdpSocket::Datagram& datagram : datagrams) {
    sizes.push_back(datagram.bytes.size());
    EXPECT_GE(datagram.stamp.tv_sec, before.tv_sec);
    EXPECT_EQ(datagram.dropped, 0u);
  }
  EXPECT_EQ(sizes, (std::vector<std::size_t>{36, 0, 1440, 1476}));
}

TEST_F(UdpSocketTest, WhatIsTooLongIsCutToASizeThatNoRecordHas) {
  send_from(box, 9000);
  const auto datagrams = socket.receive();
  ASSERT_EQ(datagrams.size(), 1u);
  EXPECT_NE(datagrams[0].bytes.size() % 36, 0u);
}

TEST_F(UdpSocketTest, HearsNobodyButItsPeer) {
  const LoopbackSocket stranger(SOCK_DGRAM);
  send_from(stranger, 36);
  send_from(box, 72);
  const auto datagrams = socket.receive();
  ASSERT_EQ(datagrams.size(), 1u);
  EXPECT_EQ(datagrams[0].bytes.size(), 72u);
}

TEST_F(UdpSocketTest, CountsWhatItsBufferCouldNotHold) {
  const std::size_t held = ReceiveBuffer{socket.receive_buffer_bytes(), 36, 1ms}.datagrams();
  const std::size_t sent = 2 * held + 1000;
  for (std::size_t i = 0; i < sent; ++i) send_from(box, 36);
  std::size_t received = 0;
  while (const std::size_t count = socket.receive().size()) received += count;
  EXPECT_LT(received, sent);
  send_from(box, 36);
  const auto last = socket.receive();
  ASSERT_EQ(last.size(), 1u);
  EXPECT_EQ(last[0].dropped, sent - received) << "the datagram behind the drops tells how many there were";
}

TEST_F(UdpSocketTest, ASmallBufferToleratesTheStallThatItTellsAndNoMore) {
  UdpSocket small("127.0.0.1", box.port(), 64 << 10);
  const ReceiveBuffer buffer{small.receive_buffer_bytes(), 36, kSingle};
  EXPECT_EQ(buffer.note(), "0.1 MiB, tolerates 22 ms; for longer set net.core.rmem_max to 4194304");
  socklen_t length = sizeof own;
  getsockname(small.descriptor(), reinterpret_cast<sockaddr*>(&own), &length);
  const auto received_of = [&](std::size_t sent) {
    for (std::size_t i = 0; i < sent; ++i) send_from(box, 36);
    std::size_t received = 0;
    while (const std::size_t count = small.receive().size()) received += count;
    return received;
  };
  const std::size_t held = 22 * 7;
  EXPECT_EQ(received_of(held), held);
  EXPECT_LT(received_of(2 * held), 2 * held);
}

TEST_F(UdpSocketTest, SendsToItsPeer) {
  const std::array<std::uint8_t, 8> request{1, 2, 3, 4, 5, 6, 7, 8};
  EXPECT_TRUE(socket.send(request));
  std::array<std::uint8_t, 64> got{};
  EXPECT_EQ(recv(box.descriptor(), got.data(), got.size(), 0), 8);
  EXPECT_EQ(got[7], 8);
}

TEST(UdpSocket, CountsRefusalsAndGoesOn) {
  const std::uint16_t closed = test::closed_port(SOCK_DGRAM);
  UdpSocket socket("127.0.0.1", closed);
  const std::array<std::uint8_t, 8> request{};
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(socket.send(request));
    EXPECT_TRUE(socket.receive().empty());
  }
  EXPECT_EQ(socket.refusals(), 5u);
  EXPECT_EQ(socket.last_error(), 0);
}

TEST(UdpSocket, AsksForFourMebibytesAndReadsBackWhatItGot) {
  UdpSocket socket("127.0.0.1", 9);
  int granted = 0;
  socklen_t length = sizeof granted;
  getsockopt(socket.descriptor(), SOL_SOCKET, SO_RCVBUF, &granted, &length);
  EXPECT_EQ(socket.receive_buffer_bytes(), static_cast<std::size_t>(granted));
  EXPECT_GT(granted, 0);
}

TEST(UdpSocket, SpeaksFromTheAddressThatItIsToldAndRefusesOneThatIsNotItsOwn) {
  LoopbackSocket box{SOCK_DGRAM};
  UdpSocket socket({"127.0.0.1", "127.0.0.3"}, box.port());
  sockaddr_in own{};
  socklen_t length = sizeof own;
  getsockname(socket.descriptor(), reinterpret_cast<sockaddr*>(&own), &length);
  EXPECT_EQ(ntohl(own.sin_addr.s_addr), 0x7f000003u);
  EXPECT_THAT(refusal([&] {
                UdpSocket({"127.0.0.1", "203.0.113.9"}, box.port());
              }),
              testing::HasSubstr("bind in the bench file must be an address of this computer"));
}

TEST(UdpSocket, AnUnknownNameIsAnError) { EXPECT_THROW(UdpSocket("no such host", 1), DeviceError); }

TEST(ReceiveBuffer, HoldsWhatWasMeasured) {
  EXPECT_NEAR(static_cast<double>(ReceiveBuffer{8'388'608, 36, kSingle}.datagrams()), 10'082, 10);
  EXPECT_NEAR(static_cast<double>(ReceiveBuffer{212'992, 36, kSingle}.datagrams()), 256, 1);
  EXPECT_NEAR(static_cast<double>(ReceiveBuffer{212'992, 1440, kForty}.datagrams()), 92, 1);
}

TEST(ReceiveBuffer, IsAWarningBelowHalfASecondAndElseANote) {
  EXPECT_FALSE((ReceiveBuffer{std::size_t{8} << 20, 36, kSingle}.finding()));
  const auto single = ReceiveBuffer{212'992, 36, kSingle}.finding(),
             forty = ReceiveBuffer{212'992, 1440, kForty}.finding();
  ASSERT_TRUE(single && forty);
  EXPECT_EQ(
      single->line(),
      "warning: the kernel grants 0.20 MiB of receive buffer instead of 8: records are lost if kphi is blocked for "
      "more than 37 ms; as root: sysctl -w net.core.rmem_max=4194304");
  EXPECT_EQ(forty->severity, Severity::note);
  EXPECT_NE(forty->what.find("more than 526 ms"), std::string::npos);
}

}  // namespace kphi::netbox::udp_socket_test
