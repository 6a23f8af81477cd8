#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <functional>
#include <thread>

#include "base/error.hpp"
#include "base/random.hpp"
#include "drivers/scpi/line.hpp"
#include "drivers/scpi/scpi_supply.hpp"
#include "test/drivers/scpi/lent_line.hpp"
#include "test/drivers/sim_equipment/scpi_tcp.hpp"
#include "test/refusal.hpp"

namespace kphi::scpi {
namespace tcp_test {

namespace asio = boost::asio;
using namespace std::chrono_literals;
using sim::FaultKind;
using testing::HasSubstr;

/// Answers each line by what `answer` gives; nothing for an empty string. One connection at a time.
class Server {
 public:
  explicit Server(std::function<std::string(const std::string&)> answer)
      : answer_(std::move(answer)),
        acceptor_(io_, {asio::ip::address_v4::loopback(), 0}),
        thread_([this] { serve(); }) {}
  ~Server() {
    stop_ = true;
    ::shutdown(connection_, SHUT_RDWR);
    boost::system::error_code ignored;
    asio::ip::tcp::socket knock(io_);
    knock.connect(acceptor_.local_endpoint(), ignored);
    knock.close(ignored);
    thread_.join();
  }
  [[nodiscard]] std::uint16_t port() const { return acceptor_.local_endpoint().port(); }

 private:
  void serve() {
    while (!stop_) {
      boost::system::error_code error;
      asio::ip::tcp::socket socket(io_);
      acceptor_.accept(socket, error);
      connection_ = socket.native_handle();
      std::string text;
      while (!error && !stop_) {
        const std::size_t n = asio::read_until(socket, asio::dynamic_buffer(text), '\n', error);
        if (error) break;
        const std::string reply = answer_(text.substr(0, n - 1));
        text.erase(0, n);
        asio::write(socket, asio::buffer(reply), error);
      }
    }
  }
  std::function<std::string(const std::string&)> answer_;
  asio::io_context io_;
  asio::ip::tcp::acceptor acceptor_;
  std::atomic<bool> stop_{false};
  std::atomic<int> connection_{-1};
  std::thread thread_;
};

std::string refusal(Tcp& line, const char* query) {
  return kphi::refusal([&] { return line.query(query); });
}

TEST(ScpiOverTcp, AsksAndAnswers) {
  Server server([](const std::string& line) { return line == "*IDN?" ? "KPHI,FAKE,1,0\r\n" : ""; });
  Tcp line("127.0.0.1", server.port());
  EXPECT_EQ(line.query("*IDN?"), "KPHI,FAKE,1,0");
  line.write("OUTP ON");
  EXPECT_EQ(line.query("*IDN?"), "KPHI,FAKE,1,0");
}

TEST(ScpiOverTcp, LetsALateAnswerDieWithItsConnection) {
  std::atomic<bool> held{true};
  Server server([&](const std::string& line) {
    if (line == "VOLT?") held.wait(true);
    return line == "VOLT?" ? "12.0\n" : "5.0\n";
  });
  Tcp line("127.0.0.1", server.port(), 100ms);
  EXPECT_THAT(refusal(line, "VOLT?"), HasSubstr("no answer in time"));
  held = false;
  held.notify_all();
  EXPECT_EQ(line.query("CURR?"), "5.0");
}

TEST(ScpiOverTcp, ThrowsAwayALineThatNobodyAskedFor) {
  Server server([](const std::string& line) { return line == "VOLT?" ? "12.0\n99.9\n" : "5.0\n"; });
  Tcp line("127.0.0.1", server.port());
  EXPECT_EQ(line.query("VOLT?"), "12.0");
  EXPECT_EQ(line.query("CURR?"), "5.0");
}

TEST(ScpiOverTcp, GivesUpAnAnswerThatDoesNotEnd) {
  Server server([](const std::string&) { return std::string(100000, '7'); });
  Tcp line("127.0.0.1", server.port());
  EXPECT_THAT(refusal(line, "CURV?"), HasSubstr("does not end"));
}

TEST(ScpiOverTcp, SaysWhenNobodyListens) {
  std::uint16_t port = 0;
  {
    Server server([](const std::string&) { return ""; });
    port = server.port();
  }
  EXPECT_THROW(Tcp("127.0.0.1", port), DeviceError);
}

TEST(ScpiOverTcp, ConnectsAgainAfterTheInstrumentHasClosed) {
  auto server = std::make_unique<Server>([](const std::string&) { return "1\n"; });
  const std::uint16_t port = server->port();
  Tcp line("127.0.0.1", port, 500ms);
  EXPECT_EQ(line.query("A?"), "1");
  server.reset();
  EXPECT_NE(refusal(line, "A?"), "");
}

/// The driver of a supply over TCP, against a simulated instrument that shares no line with them.
class TcpInstrumentTest : public testing::Test {
 protected:
  SteadyClock clock;
  sim::UsbFaults faults{clock};
  sim::ScpiInstrument instrument;
  sim::ScpiTcp server{instrument, faults};
  Tcp line{"127.0.0.1", server.port(), 200ms};
};

TEST_F(TcpInstrumentTest, SpeaksTheDialectOfRigol) {
  sim::ScpiInstrument rigol({"RIGOL TECHNOLOGIES,DP832,DP8A1,1.0", sim::ScpiKind::supply, sim::ScpiFamily::rigol});
  const sim::ScpiTcp other(rigol, faults);
  Tcp there("127.0.0.1", other.port(), 200ms);
  ScpiSupply supply(lend(there), clock);
  rigol.connect_load(1);
  const supply::Limits limits{Volts(12), Amperes(5), Volts(13.2), Amperes(6)};
  EXPECT_EQ(supply.apply(limits), limits);
  const supply::PoweredOutput output(supply);
  EXPECT_EQ(supply.read().regulation, SupplyRegulation::constant_current);
  (void)rigol.apply("OUTP:OCP:VAL 4");
  EXPECT_EQ(supply.read().protection, SupplyProtection::over_current);
}

TEST_F(TcpInstrumentTest, ConnectsAgainAfterSilenceAndAfterAnEnd) {
  for (const FaultKind kind : {FaultKind::ambient_no_reply, FaultKind::usb_closed}) {
    faults.set({{kind, {}, {}, 1}});
    EXPECT_NE(kphi::refusal([&] { (void)line.query("*IDN?"); }), "");
    EXPECT_EQ(line.query("*IDN?"), "KPHI,SIM3010,SN0001,1.00");
  }
}

TEST_F(TcpInstrumentTest, AnswersTrulyOrNotAtAllUnderAnyMixtureOfFaults) {
  Tcp fast("127.0.0.1", server.port(), 20ms);
  Random random(1);
  int answered = 0, failed = 0;
  for (int i = 0; i < 200; ++i) {
    constexpr FaultKind kKinds[] = {FaultKind::ambient_no_reply, FaultKind::ambient_late, FaultKind::usb_closed};
    sim::Fault fault{kKinds[random.bits() % 3], {}, {}, 1};
    fault.delay = Duration(static_cast<std::int64_t>(random.bits() % 40'000'000));
    if (i % 3 == 0) faults.set({fault});
    const bool volts = random.bits() % 2 == 0;
    try {
      ASSERT_EQ(fast.query(volts ? "VOLT? MAX" : "CURR? MAX"), volts ? "30.000" : "10.000") << i;
      ++answered;
    } catch (const DeviceError&) {
      ++failed;
    }
  }
  EXPECT_GT(answered, 100);
  EXPECT_GT(failed, 20);
}

}  // namespace tcp_test
}  // namespace kphi::scpi
