// What other clients of this box got wrong, one test each.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/time.h>

#include <cmath>

#include "base/error.hpp"
#include "drivers/netbox/configuration/calinfo.hpp"
#include "drivers/netbox/configuration/http.hpp"
#include "drivers/netbox/configuration/settings.hpp"
#include "drivers/netbox/receive/udp_socket.hpp"
#include "drivers/netbox/stream/session.hpp"
#include "drivers/netbox/wire/status.hpp"
#include "test/drivers/netbox/load_cell_bench.hpp"
#include "test/drivers/netbox/settable_web.hpp"

namespace kphi::netbox::traps_test {

using namespace std::chrono_literals;
using namespace test;
using SteadyTime = std::chrono::steady_clock;

/// A peer of the driver's socket, told where that is by its first datagram.
class Peer {
 public:
  Peer() : socket_(SOCK_DGRAM), driver("127.0.0.1", socket_.port()) {
    driver.send(encode_request(Command::stop));
    received_ = recvfrom(socket_.descriptor(), bytes_, sizeof bytes_, 0, reinterpret_cast<sockaddr*>(&from_), &length_);
  }
  void send(const Bytes& bytes) {
    EXPECT_EQ(sendto(socket_.descriptor(), bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&from_), length_),
              static_cast<ssize_t>(bytes.size()));
  }
  [[nodiscard]] ssize_t received() const { return received_; }

 private:
  LoopbackSocket socket_;
  sockaddr_in from_{};
  socklen_t length_ = sizeof from_;
  std::uint8_t bytes_[64]{};
  ssize_t received_ = 0;

 public:
  UdpSocket driver;
};

TEST(Traps, ASampleCountOfOneIsOneAndNot65537) {
  const std::array<std::uint8_t, 8> one{0x12, 0x34, 0, 2, 0, 0, 0, 1};
  EXPECT_EQ(encode_request(Command::real_time, 1), one);
  const std::array<std::uint8_t, 8> all_bytes_differ{0x12, 0x34, 0, 3, 1, 2, 3, 4};
  EXPECT_EQ(encode_request(Command::buffered, 0x01020304), all_bytes_differ);
}

TEST(Traps, AZeroByteEndsNeitherARequestNorADatagram) {
  Peer peer;
  EXPECT_EQ(peer.received(), 8);
  peer.send(Bytes(36, 0));
  std::span<const UdpSocket::Datagram> datagrams;
  ASSERT_TRUE(soon([&] { return !(datagrams = peer.driver.receive()).empty(); }));
  EXPECT_EQ(datagrams[0].bytes.size(), 36u);
  std::array<LoadCellRecord, kMaxRecords> out;
  EXPECT_EQ(decode(datagrams[0].bytes, out), 1u);
}

class TrapsOfTheSequence : public testing::Test {
 protected:
  TrapsOfTheSequence() {
    session.start(0s);
    session.advance(1s);
    receive(1, 1s);
  }
  void receive(std::uint32_t rdt, Instant at) { session.receive(records(rdt, 1000 + rdt), at, out); }
  Session session{StreamSettings{}};
  std::vector<LoadCellRecord> out;
};

TEST_F(TrapsOfTheSequence, ALateRecordDoesNotOverwriteTheNewestNumber) {
  for (const std::uint32_t rdt : {2u, 4u, 3u, 5u}) receive(rdt, 1s);
  EXPECT_EQ(session.counters().lost_network, 0u);
  EXPECT_EQ(out.size(), 5u);
}

TEST_F(TrapsOfTheSequence, NumbersAreNotComparedUnsigned) {
  receive(2, 1s);
  receive(4, 1s);
  session.release(2s, out);  // 3 is given up
  receive(3, 2s);
  receive(5, 2s);
  EXPECT_EQ(session.counters().lost_network, 1u) << "and not 4294967295";
  EXPECT_EQ(session.counters().late, 1u);
}

TEST(Traps, TheBoxDoesNotStreamToADeadPortAfterTheEnd) {
  BenchBox bench;
  {
    LoadCell cell(bench.address, bench.clock);
    cell.start();
    ASSERT_TRUE(cell.wait(20s));
  }
  EXPECT_TRUE(soon([&] { return !bench.box.streaming(); }));
}

TEST_F(TrapsOfTheSequence, NoFilterTouchesTheCounts) {
  Bytes bytes;
  for (std::uint32_t i = 0; i < 40; ++i) put_record(bytes, 2 + i, 1002 + i, 0, i % 2 == 0 ? 1'000'000 : -7);
  session.receive(bytes, 1s, out);
  ASSERT_EQ(out.size(), 41u);
  for (std::size_t i = 0; i < 40; ++i) EXPECT_EQ(out[i + 1].counts[2], i % 2 == 0 ? 1'000'000 : -7);
}

TEST(Traps, ASettingIsWrittenByItsNameAndWithAnEqualsSign) {
  SettableWeb web;
  const auto journal = std::filesystem::temp_directory_path() / ("kphi_traps_" + std::to_string(getpid()));
  const SettingsKeeper keeper(web.address(), {.rate_hz = 1000, .records_per_datagram = 10}, journal);
  EXPECT_THAT(web.writes(), testing::ElementsAre("/comm.cgi?comrdtrate=1000&comrdtbsiz=10"));
}

TEST(Traps, ABacklogIsTakenAtOnceAndNotOneDatagramPerCycle) {
  Peer peer;
  for (std::uint32_t i = 0; i < 60; ++i) peer.send(records(1 + i, 1 + i));
  std::size_t taken = 0, calls = 0;
  ASSERT_TRUE(soon([&] {
    const std::size_t count = peer.driver.receive().size();
    if (count > 0) ++calls;
    return (taken += count) == 60;
  }));
  EXPECT_LE(calls, 3u);
}

TEST(Traps, ATimeoutOfAQuarterSecondIsAQuarterSecond) {
  FakeWeb web({{"HTTP/1.0 200 OK\r\n"}, 60s});
  const auto begun = SteadyTime::now();
  EXPECT_THROW((void)http_get("127.0.0.1", web.port(), "/", 250ms), DeviceError);
  const auto http = SteadyTime::now() - begun;
  EXPECT_GE(http, 249ms);
  EXPECT_LT(http, 10s);
  Bench bench;
  const auto waiting = SteadyTime::now();
  EXPECT_FALSE(bench.cell.wait(250ms));
  EXPECT_GE(SteadyTime::now() - waiting, 249ms);
}

TEST(Traps, NoOldRecordIsGivenAgainWhenNothingComes) {
  Bench bench({.mute_after_1000 = true});
  bench.cell.start();
  std::vector<LoadCellRecord> out(4096);
  std::size_t taken = 0;
  ASSERT_TRUE(soon([&] {
    taken += bench.cell.take(out);
    return bench.cell.state() == State::silent;
  }));
  taken += bench.cell.take(out);
  EXPECT_EQ(taken, 1000u);
  EXPECT_EQ(bench.cell.take(out), 0u);
  EXPECT_FALSE(bench.cell.wait(0ns));
}

TEST_F(TrapsOfTheSequence, ALatchedMonitorConditionIsHealthyAndAnErrorIsNoException) {
  Bytes bytes;
  put_record(bytes, 2, 1002, 0x80010000);
  put_record(bytes, 3, 1003, 0xC0000000);
  session.receive(bytes, 1s, out);
  ASSERT_EQ(out.size(), 3u);
  EXPECT_TRUE(healthy(out[1].status));
  EXPECT_FALSE(healthy(out[2].status));
}

TEST(Traps, ALostDatagramNeverHangsTheClient) {
  Bench bench({.starts_ignored = 1000});
  EXPECT_THROW(bench.cell.start(), DeviceError);
  EXPECT_FALSE(bench.cell.wait(1ms));
}

TEST(Traps, OneReadIsNotOneMessage) {
  std::vector<std::string> byte_by_byte;
  for (const char byte : streaming_xml()) byte_by_byte.push_back(std::string(1, byte));
  byte_by_byte.insert(byte_by_byte.begin(), "HTTP/1.0 200 OK\r\n\r\n");
  FakeWeb web({byte_by_byte});
  EXPECT_EQ(http_get("127.0.0.1", web.port(), "/netftapi2.xml", 20s), streaming_xml());
  // Of the 16-bit interface: Calinfo.ReadsAnAnswerInPieces. What is cut short is no message:
  const Bytes cut(18, 0x12);
  EXPECT_EQ(decode_calinfo(cut), std::nullopt);
}

TEST(Traps, ARecordIsStampedWhenItArrivesAndNotWhenItIsRead) {
  Peer peer;
  const auto is_stamped_at_arrival = [&] {
    peer.send(records(1, 1));
    timespec sent{};
    clock_gettime(CLOCK_REALTIME, &sent);
    const auto read_at = SteadyTime::now() + 50ms;
    EXPECT_TRUE(soon([&] { return SteadyTime::now() > read_at; }));
    const auto datagrams = peer.driver.receive();
    if (datagrams.size() != 1) return false;
    const timespec& stamp = datagrams[0].stamp;
    return std::abs(static_cast<double>(stamp.tv_sec - sent.tv_sec) +
                    1e-9 * static_cast<double>(stamp.tv_nsec - sent.tv_nsec)) < 0.04;
  };
  // The kernel begins to stamp a moment after the first socket has asked for it.
  EXPECT_TRUE(soon(is_stamped_at_arrival));
}

TEST(Traps, ASignalExtendsNoTimeout) {
  Bench bench;
  struct sigaction action {
  }, before{};
  action.sa_handler = [](int) {};
  sigaction(SIGALRM, &action, &before);
  const itimerval every_5_ms{{0, 5000}, {0, 5000}}, never{};
  setitimer(ITIMER_REAL, &every_5_ms, nullptr);
  const auto begun = SteadyTime::now();
  EXPECT_FALSE(bench.cell.wait(200ms));
  const auto took = SteadyTime::now() - begun;
  setitimer(ITIMER_REAL, &never, nullptr);
  sigaction(SIGALRM, &before, nullptr);
  EXPECT_GE(took, 199ms);
  EXPECT_LT(took, 5s);
}

TEST_F(TrapsOfTheSequence, AStandingMeasurementIsNotDeliveredAsNew) {
  for (std::uint32_t rdt = 2; rdt < 12; ++rdt) session.receive(records(rdt, 1001), 1s, out);
  EXPECT_EQ(out.size(), 1u);
  EXPECT_EQ(session.counters().stalled, 10u);
}

TEST(Traps, NothingIsWrittenAndNoStreamIsTakenAtStartUp) {
  SettableWeb web;
  FakeBox box({});
  const SteadyClock clock;
  const LoadCell cell({"127.0.0.1", box.port(), web.port()}, clock);
  EXPECT_THAT(web.writes(), testing::IsEmpty());
  EXPECT_EQ(box.starts() + box.stops() + box.biases() + box.settings_written(), 0);
}

}  // namespace kphi::netbox::traps_test
