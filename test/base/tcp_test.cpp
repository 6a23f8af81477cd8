#include "base/tcp.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "base/descriptor.hpp"

namespace kphi {
namespace tcp_test {

class TcpFrom : public testing::Test {
 protected:
  TcpFrom() {
    sockaddr_in here{};
    here.sin_family = AF_INET;
    here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof here;
    EXPECT_EQ(::bind(listener_.number(), reinterpret_cast<sockaddr*>(&here), size), 0);
    EXPECT_EQ(::listen(listener_.number(), 4), 0);
    EXPECT_EQ(::getsockname(listener_.number(), reinterpret_cast<sockaddr*>(&here), &size), 0);
    port_ = ntohs(here.sin_port);
  }
  /// Who has connected.
  [[nodiscard]] std::string peer() const {
    sockaddr_in there{};
    socklen_t size = sizeof there;
    const Descriptor connection(::accept(listener_.number(), reinterpret_cast<sockaddr*>(&there), &size));
    char text[INET_ADDRSTRLEN]{};
    (void)::inet_ntop(AF_INET, &there.sin_addr, text, sizeof text);
    return text;
  }
  Descriptor listener_{::socket(AF_INET, SOCK_STREAM, 0)};
  std::uint16_t port_ = 0;
};

TEST_F(TcpFrom, SpeaksFromTheAddressThatItIsToldOrAsTheKernelRoutes) {
  TcpClient told(std::chrono::seconds(10)), routed(std::chrono::seconds(10));
  told.connect({"127.0.0.1", "127.0.0.3"}, port_);
  EXPECT_EQ(peer(), "127.0.0.3");
  routed.connect("127.0.0.1", port_);
  EXPECT_EQ(peer(), "127.0.0.1");
}

TEST_F(TcpFrom, RefusesAnAddressThatIsNotItsOwn) {
  for (const char* from : {"203.0.113.9", "not an address"}) {
    TcpClient client(std::chrono::seconds(10));
    try {
      client.connect({"127.0.0.1", from}, port_);
      ADD_FAILURE() << from;
    } catch (const TcpError& error) {
      EXPECT_EQ(error.cause, TcpError::Cause::no_such_address);
    }
  }
}

}  // namespace tcp_test
}  // namespace kphi
