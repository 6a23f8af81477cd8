#include "drivers/netbox/configuration/calinfo.hpp"

#include <gmock/gmock.h>
#include <linux/sockios.h>
#include <netinet/in.h>
#include <sys/ioctl.h>

#include <cstdio>
#include <fstream>
#include <string>
#include <thread>

#include "test/drivers/netbox/fake_box.hpp"
#include "test/refusal.hpp"

namespace kphi::netbox::calinfo_test {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// The manual's example: N, N-m, 1e6 each; an SI-40-2.
const test::Bytes kExample = {0x12, 0x34, 0x02, 0x03, 0x00, 0x0f, 0x42, 0x40, 0x00, 0x0f, 0x42, 0x40,
                              0x04, 0xc5, 0x04, 0xc5, 0x0e, 0x4e, 0x00, 0x3d, 0x00, 0x3d, 0x00, 0x3d};

Configuration si_box() {
  Configuration configuration;
  configuration.counts_per_newton = configuration.counts_per_newton_metre = 1e6;
  return configuration;
}

/// Whether bytes sent over this loopback connection wait in the kernel: unacknowledged here, or unread at the other
/// end, whose queue the kernel's table shows. False once the other end has closed.
bool is_unread(int connection) {
  int unacknowledged = 0;
  sockaddr_in own{}, peer{};
  socklen_t size = sizeof own;
  if (ioctl(connection, SIOCOUTQ, &unacknowledged) != 0 ||
      getsockname(connection, reinterpret_cast<sockaddr*>(&own), &size) != 0 ||
      getpeername(connection, reinterpret_cast<sockaddr*>(&peer), &size) != 0)
    return false;
  std::ifstream table("/proc/net/tcp");
  std::string line;
  while (std::getline(table, line)) {
    unsigned local = 0, remote = 0, sent = 0, unread = 0;
    if (std::sscanf(line.c_str(), " %*d: %*8x:%4x %*8x:%4x %*2x %8x:%8x", &local, &remote, &sent, &unread) != 4)
      continue;
    if (local == ntohs(peer.sin_port) && remote == ntohs(own.sin_port)) return unread > 0 || unacknowledged > 0;
  }
  return false;
}

/// Answers one request per connection with given bytes, in pieces.
class FakeTcp {
 public:
  explicit FakeTcp(std::vector<test::Bytes> pieces) : pieces_(std::move(pieces)), socket_(SOCK_STREAM) {
    if (listen(socket_.descriptor(), 4) != 0) throw std::runtime_error("listen");
    thread_ = std::thread([this] { serve(); });
  }
  ~FakeTcp() {
    shutdown(socket_.descriptor(), SHUT_RDWR);
    thread_.join();
  }
  std::uint16_t port() const { return socket_.port(); }
  test::Bytes request;  ///< of the last connection that has ended

 private:
  void serve() {
    for (int client; (client = accept(socket_.descriptor(), nullptr, nullptr)) >= 0; close(client)) {
      test::Bytes bytes(20);
      if (recv(client, bytes.data(), bytes.size(), MSG_WAITALL) != 20) continue;
      request = bytes;
      for (const test::Bytes& piece : pieces_) {
        send(client, piece.data(), piece.size(), MSG_NOSIGNAL);
        while (is_unread(client)) std::this_thread::yield();  // so that pieces do not join on their way
      }
    }
  }
  std::vector<test::Bytes> pieces_;
  test::LoopbackSocket socket_;
  std::thread thread_;
};

std::string failure_of(std::uint16_t port, std::chrono::nanoseconds timeout = 2s) {
  return refusal([&] { return read_calinfo("127.0.0.1", port, timeout); });
}

TEST(Calinfo, TheRequestIsTwentyBytes) {
  std::array<std::uint8_t, 20> expected{};
  expected[0] = 1;
  EXPECT_EQ(encode_read_calinfo(), expected);
}

TEST(Calinfo, DecodesTheManualsExample) { EXPECT_EQ(decode_calinfo(kExample), (Calinfo{2, 3, 1'000'000, 1'000'000})); }

TEST(Calinfo, RefusesWrongSizesAndHeaders) {
  for (std::size_t size = 0; size < kExample.size(); ++size)
    EXPECT_FALSE(decode_calinfo(std::span(kExample).first(size)));
  test::Bytes longer = kExample, other = kExample;
  longer.push_back(0);
  other[1] = 0x35;
  EXPECT_FALSE(decode_calinfo(longer));
  EXPECT_FALSE(decode_calinfo(other));
}

TEST(Calinfo, ReadsAnAnswerInPieces) {
  FakeTcp box({test::Bytes(kExample.begin(), kExample.begin() + 5), test::Bytes(kExample.begin() + 5, kExample.end())});
  EXPECT_EQ(read_calinfo("127.0.0.1", box.port(), 2s), decode_calinfo(kExample));
}

TEST(Calinfo, AShortAnswerAndThatOfSomethingElseAreErrors) {
  FakeTcp cut({test::Bytes(kExample.begin(), kExample.begin() + 18)}), other({test::Bytes(24, 'H')});
  EXPECT_THAT(failure_of(cut.port()), HasSubstr("read the calibration over TCP"));
  EXPECT_THAT(failure_of(other.port()), HasSubstr("not a Net Box"));
}

TEST(Calinfo, ABoxThatIsMuteIsAnErrorInTime) {
  test::LoopbackSocket mute(SOCK_STREAM);
  listen(mute.descriptor(), 4);
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_THAT(failure_of(mute.port(), 50ms), HasSubstr("no answer within 0.1 s"));
  EXPECT_LT(std::chrono::steady_clock::now() - begun, 2s);
}

TEST(CalinfoComparison, FindsADisagreementAndNothingElse) {
  const Calinfo example = *decode_calinfo(kExample);
  struct Case {
    Calinfo calinfo;
    const char* what;  ///< null: nothing is found
  };
  for (const auto& [calinfo, what] : std::vector<Case>{{example, nullptr},
                                                       {{2, 4, 1'000'000, 1000}, nullptr},  // N mm
                                                       {{2, 3, 600'000, 1'000'000}, "over HTTP"},
                                                       {{2, 3, 1'000'000, 1'000'010}, "over HTTP"},
                                                       {{1, 3, 1'000'000, 1'000'000}, "over HTTP"},  // lbf
                                                       {{7, 3, 1'000'000, 1'000'000}, "unknown units 7 and 3"}}) {
    const auto finding = compare(calinfo, si_box());
    ASSERT_EQ(finding.has_value(), what != nullptr);
    if (!what) continue;
    EXPECT_EQ(finding->severity, Severity::fault);
    EXPECT_THAT(finding->what, HasSubstr(what));
  }
}

TEST(CalinfoCrossCheck, AsksAndComparesAndNotesABoxWithoutTheInterface) {
  FakeTcp box({kExample});
  EXPECT_FALSE(cross_check("127.0.0.1", box.port(), si_box(), 2s));
  const test::LoopbackSocket closed(SOCK_STREAM);  // bound, not listening
  const auto finding = cross_check("127.0.0.1", closed.port(), si_box(), 2s);
  ASSERT_TRUE(finding);
  EXPECT_EQ(finding->severity, Severity::note);
}

}  // namespace kphi::netbox::calinfo_test
