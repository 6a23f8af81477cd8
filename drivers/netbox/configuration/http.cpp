#include "drivers/netbox/configuration/http.hpp"

#include <fmt/format.h>

#include <boost/algorithm/string/predicate.hpp>
#include <boost/algorithm/string/trim.hpp>
#include <cctype>
#include <optional>
#include <string_view>

#include "base/error.hpp"
#include "base/number.hpp"
#include "base/tcp.hpp"

namespace kphi::netbox {
namespace {

constexpr std::size_t kHeadLimit = 8192, kBodyLimit = 1 << 20;

/// An answer that is not one of a Net Box's web server.
struct Refused {
  std::string cause, next_move;
};
const Refused kNotHttp{"the answer is not HTTP", "not a Net Box: check the address and http_port"};
const Refused kTooLong{"the answer is longer than 1 MiB", "not a Net Box: check the address"};
const Refused kCutShort{"the connection ended early", "the box broke off; try again, then power-cycle the box"};

struct Response {
  int status = 0;
  std::string body;
};

/// "HTTP/1.x NNN …"
int status_of(std::string_view head) {
  const bool valid = head.size() >= 12 && head.starts_with("HTTP/1.") && std::isdigit(head[7]) && head[8] == ' ';
  const auto status = valid ? parse_integer<int>(std::string(head.substr(9, 3))) : std::nullopt;
  if (!status) throw kNotHttp;
  return *status;
}

/// Value of the header `name`; nullopt if it is missing.
std::optional<std::string> header(std::string_view head, std::string_view name) {
  for (std::size_t at = head.find("\r\n"); at != std::string_view::npos; at = head.find("\r\n", at + 2)) {
    const std::string_view line = head.substr(at + 2, head.find("\r\n", at + 2) - (at + 2));
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos || !boost::algorithm::iequals(line.substr(0, colon), name)) continue;
    return boost::algorithm::trim_copy(std::string(line.substr(colon + 1)));
  }
  return std::nullopt;
}

/// Bytes of the body; nullopt: up to the end of the connection.
std::optional<std::size_t> body_size(std::string_view head) {
  if (header(head, "Transfer-Encoding")) throw kNotHttp;
  const auto text = header(head, "Content-Length");
  if (!text) return std::nullopt;
  const auto size = parse_integer<std::uint64_t>(*text);
  if (!size) throw kNotHttp;
  if (*size > kBodyLimit) throw kTooLong;
  return *size;
}

Response read_response(TcpClient& box) {
  constexpr std::string_view kScheme = "HTTP/";
  std::string received;
  std::size_t end = std::string::npos;
  while ((end = received.find("\r\n\r\n")) == std::string::npos) {
    const std::size_t known = std::min(received.size(), kScheme.size());
    if (received.size() > kHeadLimit || received.substr(0, known) != kScheme.substr(0, known)) throw kNotHttp;
    if (!box.receive(received)) throw kCutShort;
  }
  const std::string head = received.substr(0, end);
  Response response{status_of(head), received.substr(end + 4)};
  const auto size = body_size(head);
  while (!size || response.body.size() < *size) {
    if (response.body.size() > kBodyLimit) throw kTooLong;
    if (box.receive(response.body)) continue;
    if (size) throw kCutShort;
    break;
  }
  if (size) response.body.resize(*size);
  return response;
}

std::string advice(const TcpError& error, std::uint16_t port) {
  switch (error.cause) {
    case TcpError::Cause::refused:
      return fmt::format("a device is at this address, but no web server on port {}: check the address and http_port",
                         port);
    case TcpError::Cause::timeout:
      return "check the address, the cable and the box's power; the box serves one connection at a time: close its web "
             "pages";
    default:
      return "check the address, the cable and the box's power";
  }
}

}  // namespace

std::string http_get(const std::string& host, std::uint16_t port, const std::string& target,
                     std::chrono::nanoseconds wall_timeout, int wanted_status) {
  const std::string device = fmt::format("Net Box {}:{}", host, port);
  const std::string operation = "GET " + target;
  TcpClient box(wall_timeout);
  try {
    box.connect(host, port);
    box.send(fmt::format("{} HTTP/1.0\r\nHost: {}\r\n\r\n", operation, host));
    Response response = read_response(box);
    if (response.status == wanted_status) return std::move(response.body);
    throw DeviceError(device, operation, fmt::format("HTTP status {}", response.status),
                      "check that this is a Net Box: open the address in a browser");
  } catch (const Refused& refused) {
    throw DeviceError(device, operation, fmt::format("could not {}: {}", box.step(), refused.cause), refused.next_move);
  } catch (const TcpError& error) {
    const double seconds = std::chrono::duration<double>(wall_timeout).count();
    throw DeviceError(device, operation,
                      error.cause == TcpError::Cause::timeout
                          ? fmt::format("no answer within {:.1f} s (could not {})", seconds, box.step())
                          : fmt::format("could not {}: {}", box.step(), error.what()),
                      advice(error, port));
  }
}

}  // namespace kphi::netbox
