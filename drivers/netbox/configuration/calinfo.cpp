#include "drivers/netbox/configuration/calinfo.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/endian/conversion.hpp>
#include <cmath>

#include "base/clock.hpp"
#include "base/error.hpp"
#include "base/tcp.hpp"
#include "drivers/netbox/wire/unit.hpp"

namespace kphi::netbox {
namespace {

constexpr std::uint8_t kReadCalinfo = 1;
constexpr std::uint16_t kHeader = 0x1234;

/// 0 for an unknown code.
double si_of(std::span<const Unit> units, int code) {
  const auto known = std::ranges::find(units, code, &Unit::code);
  return known == units.end() ? 0 : known->si;
}

bool agree(double one, double other) { return std::abs(one - other) <= 1e-6 * std::abs(other); }

}  // namespace

std::array<std::uint8_t, 20> encode_read_calinfo() noexcept { return {kReadCalinfo}; }

std::optional<Calinfo> decode_calinfo(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != kCalinfoBytes || boost::endian::load_big_u16(bytes.data()) != kHeader) return std::nullopt;
  return Calinfo{bytes[2], bytes[3], boost::endian::load_big_u32(&bytes[4]), boost::endian::load_big_u32(&bytes[8])};
}

Calinfo read_calinfo(const Host& host, std::uint16_t port, std::chrono::nanoseconds wall_timeout) {
  const auto fail = [&](const std::string& cause, const char* next_move) {
    throw DeviceError(fmt::format("Net Box {}:{}", host.name, port), "read the calibration over TCP", cause, next_move);
  };
  TcpClient box(wall_timeout);
  std::string answer;
  try {
    box.connect(host, port);
    const auto request = encode_read_calinfo();
    box.send({reinterpret_cast<const char*>(request.data()), request.size()});
    while (answer.size() < kCalinfoBytes && box.receive(answer)) {
    }
  } catch (const TcpError& error) {
    if (error.cause != TcpError::Cause::timeout) fail(error.what(), "check that this is a Net Box");
    fail(fmt::format("no answer within {:.1f} s", to_seconds(wall_timeout)),
         "check the address, and that no firewall blocks TCP");
  }
  if (answer.size() < kCalinfoBytes)
    fail("the answer is cut short", "check that this is a Net Box; if it is, power-cycle it");
  const auto calinfo = decode_calinfo({reinterpret_cast<const std::uint8_t*>(answer.data()), kCalinfoBytes});
  if (!calinfo) fail("unexpected reply: not a Net Box", "check the address and port");
  return *calinfo;
}

std::optional<Finding> compare(const Calinfo& calinfo, const Configuration& configuration) {
  const double force = si_of(kForceUnits, calinfo.force_unit), torque = si_of(kTorqueUnits, calinfo.torque_unit);
  if (force == 0 || torque == 0) {
    return Finding{
        Severity::fault,
        fmt::format("the box reports the unknown units {} and {} over TCP", calinfo.force_unit, calinfo.torque_unit),
        "choose N and N-m on the box's Configurations page"};
  }
  const double per_newton = calinfo.counts_per_force / force, per_metre = calinfo.counts_per_torque / torque;
  if (agree(per_newton, configuration.counts_per_newton) && agree(per_metre, configuration.counts_per_newton_metre))
    return std::nullopt;
  return Finding{
      Severity::fault,
      fmt::format("scale mismatch: {:g} counts per N and {:g} per N m over TCP, {:g} and {:g} over HTTP", per_newton,
                  per_metre, configuration.counts_per_newton, configuration.counts_per_newton_metre),
      "power-cycle the box and read again; do not measure until they agree"};
}

std::optional<Finding> cross_check(const Host& host, std::uint16_t port, const Configuration& configuration,
                                   std::chrono::nanoseconds wall_timeout) {
  try {
    return compare(read_calinfo(host, port, wall_timeout), configuration);
  } catch (const DeviceError& error) {
    return Finding{Severity::note, fmt::format("could not cross-check the scale: {}", error.what()), ""};
  }
}

}  // namespace kphi::netbox
