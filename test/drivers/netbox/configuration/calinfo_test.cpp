#include "drivers/netbox/configuration/calinfo.hpp"

#include <gmock/gmock.h>

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
        usleep(2000);  // parts the pieces on their way: when the reader has taken one cannot be seen from here
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
