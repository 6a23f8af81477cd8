#include "daq/live/udp_json.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <nlohmann/json.hpp>

#include "base/error.hpp"

namespace kphi::daq::live {
namespace udp_json_test {

using boost::asio::ip::udp;

TEST(UdpJson, SendsOneDatagramPerTick) {
  boost::asio::io_context io;
  udp::socket plotter(io, udp::endpoint(boost::asio::ip::address_v4::loopback(), 0));
  UdpJson sender(fmt::format("localhost:{}", plotter.local_endpoint().port()), {});
  for (int i = 0; i < 3; ++i) {
    Tick tick;
    tick.time_s = i;
    sender.send(tick);
  }
  for (int i = 0; i < 3; ++i) {
    std::array<char, 2048> bytes{};
    const std::size_t n = plotter.receive(boost::asio::buffer(bytes));  // of loopback: it is there already
    EXPECT_EQ(nlohmann::json::parse(bytes.begin(), bytes.begin() + static_cast<long>(n)).at("time_s"), i);
  }
  EXPECT_EQ(plotter.available(), 0u);
}

TEST(UdpJson, DoesNotMindThatNobodyListens) {
  boost::asio::io_context io;
  std::uint16_t port = 0;
  {
    udp::socket gone(io, udp::endpoint(boost::asio::ip::address_v4::loopback(), 0));
    port = gone.local_endpoint().port();
  }
  UdpJson sender(fmt::format("127.0.0.1:{}", port), {});
  for (int i = 0; i < 10; ++i) sender.send(Tick{});
}

TEST(UdpJson, RefusesWhatIsNotOneMachine) {
  for (const char* address :
       {"127.0.0.1", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:70000", "plotter.example:9870", "0.0.0.0:9870",
        "255.255.255.255:9870", "239.1.2.3:9870", "[::]:9870", "[ff02::1]:9870", ":9870", "127.0.0.1:98x"}) {
    EXPECT_THROW(UdpJson(address, {}), ConfigurationError) << address;
  }
}

}  // namespace udp_json_test
}  // namespace kphi::daq::live
