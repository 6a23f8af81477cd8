#include "drivers/netbox/configuration/calinfo.hpp"

#include <fmt/format.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/endian/conversion.hpp>
#include <cmath>

#include "base/error.hpp"
#include "drivers/netbox/wire/units.hpp"

namespace kphi::netbox {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::uint8_t kReadCalinfo = 1;
constexpr std::uint16_t kHeader = 0x1234;

/// One request on its way through resolve, connect, write, read.
class Exchange {
 public:
  explicit Exchange(asio::io_context& io) : resolver_(io), socket_(io) {}

  void begin(const std::string& host, std::uint16_t port) {
    resolver_.async_resolve(host, std::to_string(port), [this](error_code error, auto endpoints) {
      if (!proceed(error)) return;
      asio::async_connect(socket_, endpoints, [this](error_code failure, const auto&) {
        if (proceed(failure)) write();
      });
    });
  }
  [[nodiscard]] bool done() const { return done_; }
  [[nodiscard]] error_code error() const { return error_; }
  [[nodiscard]] std::span<const std::uint8_t> answer() const { return answer_; }

 private:
  void write() {
    asio::async_write(socket_, asio::buffer(request_), [this](error_code error, std::size_t) {
      if (!proceed(error)) return;
      asio::async_read(socket_, asio::buffer(answer_), [this](error_code failure, std::size_t) {
        error_ = failure;
        done_ = true;
      });
    });
  }
  bool proceed(error_code error) {
    error_ = error;
    done_ = static_cast<bool>(error);
    return !error;
  }

  tcp::resolver resolver_;
  tcp::socket socket_;
  const std::array<std::uint8_t, 20> request_ = encode_read_calinfo();
  std::array<std::uint8_t, kCalinfoBytes> answer_{};
  error_code error_;
  bool done_ = false;
};

bool agree(double one, double other) { return std::abs(one - other) <= 1e-6 * std::abs(other); }

}  // namespace

std::array<std::uint8_t, 20> encode_read_calinfo() noexcept { return {kReadCalinfo}; }

std::optional<Calinfo> decode_calinfo(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != kCalinfoBytes || boost::endian::load_big_u16(bytes.data()) != kHeader) return std::nullopt;
  Calinfo calinfo;
  calinfo.force_unit = bytes[2];
  calinfo.torque_unit = bytes[3];
  calinfo.counts_per_force = boost::endian::load_big_u32(&bytes[4]);
  calinfo.counts_per_torque = boost::endian::load_big_u32(&bytes[8]);
  for (std::size_t axis = 0; axis < 6; ++axis)
    calinfo.scale_factors[axis] = boost::endian::load_big_u16(&bytes[12 + 2 * axis]);
  return calinfo;
}

Calinfo read_calinfo(const std::string& host, std::uint16_t port, std::chrono::nanoseconds wall_timeout) {
  const std::string device = fmt::format("Net Box {}:{}", host, port);
  constexpr const char* kOperation = "read the calibration over TCP";
  asio::io_context io;
  Exchange exchange(io);
  exchange.begin(host, port);
  io.run_for(wall_timeout);
  if (!exchange.done()) {
    throw DeviceError(device, kOperation,
                      fmt::format("no answer within {:.1f} s", std::chrono::duration<double>(wall_timeout).count()),
                      "check the address and that no firewall holds back TCP");
  }
  if (exchange.error())
    throw DeviceError(device, kOperation, exchange.error().message(), "check that this is a Net Box");
  const auto calinfo = decode_calinfo(exchange.answer());
  if (!calinfo) throw DeviceError(device, kOperation, "the answer is none of a Net Box", "check address and port");
  return *calinfo;
}

std::optional<Finding> compare(const Calinfo& calinfo, const Configuration& configuration) {
  const auto force = newtons_in(calinfo.force_unit);
  const auto torque = newton_metres_in(calinfo.torque_unit);
  if (!force || !torque) {
    return Finding{
        Severity::fault,
        fmt::format("over TCP the box names the unknown units {} and {}", calinfo.force_unit, calinfo.torque_unit),
        "choose N and N-m on the box's Configurations page"};
  }
  const double per_newton = calinfo.counts_per_force / *force, per_metre = calinfo.counts_per_torque / *torque;
  if (agree(per_newton, configuration.counts_per_newton) && agree(per_metre, configuration.counts_per_newton_metre))
    return std::nullopt;
  return Finding{
      Severity::fault,
      fmt::format("the scale read over TCP ({:g} counts per N, {:g} per Nm) is not that read over HTTP "
                  "({:g}, {:g})",
                  per_newton, per_metre, configuration.counts_per_newton, configuration.counts_per_newton_metre),
      "power-cycle the box and read again; do not measure before they agree"};
}

std::optional<Finding> cross_check(const std::string& host, std::uint16_t port, const Configuration& configuration,
                                   std::chrono::nanoseconds wall_timeout) {
  try {
    return compare(read_calinfo(host, port, wall_timeout), configuration);
  } catch (const DeviceError& error) {
    return Finding{Severity::note, fmt::format("the scale could not be cross-checked: {}", error.what()), ""};
  }
}

}  // namespace kphi::netbox
