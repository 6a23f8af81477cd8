// A session without a wire: what it wants sent, what it is given, at times of the test's choosing.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "drivers/netbox/stream/session.hpp"
#include "test/drivers/netbox/record_bytes.hpp"
#include "test/drivers/netbox/stream/feed.hpp"

namespace kphi::netbox::test {

using namespace std::chrono_literals;

class SessionTest : public testing::Test {
 protected:
  /// What the session wants the box to be told, as command codes.
  std::vector<int> told() {
    std::vector<int> commands;
    std::array<std::uint8_t, 8> request;
    while (session.next_request(request)) {
      EXPECT_EQ(request[0], 0x12);
      EXPECT_EQ(request[1], 0x34);
      EXPECT_THAT(std::vector(request.begin() + 4, request.end()), testing::Each(0));
      commands.push_back(request[2] << 8 | request[3]);
    }
    return commands;
  }
  void advance_to_deadline() {
    ASSERT_NE(session.deadline(), kNever);
    now = session.deadline();
    session.advance(now);
  }
  void receive(const Bytes& datagram) { session.receive(datagram, now, out); }
  /// Forty records from `rdt` on, their ft_sequence so far ahead.
  void receive_block(std::uint32_t rdt, std::uint32_t ft_ahead = 999) { receive(records(rdt, rdt + ft_ahead, 40)); }
  /// Blocks as a box sends them, from the second one on, until `end`; the session's time goes on.
  void stream_until(Instant end) {
    for (std::uint32_t i = 1; now < end; ++i) {
      now += settings.datagram_period();
      receive_block(1 + 40 * i);
      session.advance(now);
    }
  }
  /// What is not zero of a few: "lost 1, late 2".
  [[nodiscard]] std::string counted() const { return words_of(session.counters()); }
  void start_streaming(std::uint32_t ft = 1000) {
    session.start(now);
    advance_to_deadline();
    told();
    receive_block(1, ft - 1);
    ASSERT_EQ(session.state(), State::streaming);
  }

  Instant now = 1s;
  StreamSettings settings;
  Session session{settings};
  std::vector<LoadCellRecord> out;
};

}  // namespace kphi::netbox::test
