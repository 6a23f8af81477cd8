// The happy path against the library's own server: a third opinion on the wire.
#include <gtest/gtest.h>
#include <modbus/modbus.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <thread>

#include "drivers/supply/modbus_supply.hpp"
#include "test/drivers/supply/simulated_supply.hpp"

namespace kphi::supply {
namespace libmodbus_server_test {

/// Registers 0 to 127 of a plain memory, on TCP.
class LibraryServer {
 public:
  LibraryServer() : context_(modbus_new_tcp("127.0.0.1", 0)), registers_(modbus_mapping_new(0, 0, 128, 0)) {
    listening_ = modbus_tcp_listen(context_, 1);
    sockaddr_in at{};
    socklen_t size = sizeof at;
    getsockname(listening_, reinterpret_cast<sockaddr*>(&at), &size);
    port_ = ntohs(at.sin_port);
    const std::array<std::uint16_t, 21> riden{60062, 0, 42, 135, 0, 25, 0, 77, 1200, 5000, 1198, 1234, 0, 1478, 2405};
    std::copy(riden.begin(), riden.end(), registers_->tab_registers);
    thread_ = std::thread([this] { serve(); });
  }
  ~LibraryServer() {
    shutdown(listening_, SHUT_RDWR);
    thread_.join();
    close(listening_);
    modbus_mapping_free(registers_);
    modbus_free(context_);
  }
  [[nodiscard]] std::string uri() const { return "modbus-tcp:127.0.0.1:" + std::to_string(port_); }

 private:
  void serve() {
    if (modbus_tcp_accept(context_, &listening_) < 0) return;
    std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> query{};
    for (int count = 0; (count = modbus_receive(context_, query.data())) >= 0;) {
      modbus_reply(context_, query.data(), count, registers_);
    }
    modbus_close(context_);
  }

  modbus_t* context_;
  modbus_mapping_t* registers_;
  int listening_ = -1;
  std::uint16_t port_ = 0;
  std::thread thread_;
};

TEST(LibmodbusServer, AndTheDriverUnderstandEachOther) {
  LibraryServer server;
  SteadyClock clock;
  ModbusSupply supply(parse_address(server.uri()), clock, test::kShort);
  EXPECT_EQ(supply.identity().model, "RD6006");
  EXPECT_EQ(supply.identity().serial, "00000042");
  EXPECT_EQ(supply.identity().firmware, "1.35");
  EXPECT_DOUBLE_EQ(supply.read().voltage_v, 11.98);
  EXPECT_DOUBLE_EQ(supply.read().current_a, 1.234);
  supply.apply({Volts(1.13), Amperes(2), Volts(13), Amperes(3)});
  EXPECT_DOUBLE_EQ(supply.read().set_voltage_v, 1.13);
  {
    PoweredOutput on(supply);
    EXPECT_TRUE(supply.read().output);
  }
  EXPECT_FALSE(supply.read().output);
}

}  // namespace libmodbus_server_test
}  // namespace kphi::supply
