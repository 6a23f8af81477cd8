#include "drivers/netbox/configuration/http.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <string_view>
#include <thread>

#include "base/error.hpp"
#include "base/tcp.hpp"
#include "drivers/netbox/configuration/interfaces.hpp"

namespace kphi::netbox {
namespace {

namespace http = boost::beast::http;

constexpr std::size_t kHeadLimit = 8192, kBodyLimit = 1 << 20;
constexpr std::chrono::milliseconds kPauseAfterRefusal{300};
constexpr const char* kCloseOthers = "close the box's web pages and other programs that ask it";

/// Why there is no page.
struct Refused {
  std::string cause, next_move;
  bool may_pass = false;  ///< a box that was asked too often says so, too
};
const Refused kNotHttp{"could not read the answer: the answer is not HTTP",
                       "not a Net Box: check the address and http_port"};
const Refused kTooLong{"could not read the answer: the answer is longer than 1 MiB",
                       "not a Net Box: check the address"};
const Refused kCutShort{"could not read the answer: the connection ended early", "try again, then power-cycle the box"};
const Refused kNoWord{kCutShort.cause, kCloseOthers, true};

void refuse_if_wrong(const boost::system::error_code& error) {
  if (!error || error == http::error::need_more) return;
  if (error == http::error::partial_message) throw kCutShort;
  throw error == http::error::body_limit ? kTooLong : kNotHttp;
}

/// Behind the blank line that ends the head; npos: it is not there yet.
std::size_t end_of_head(std::string_view answer) {
  for (std::size_t at = answer.find('\n'); at != std::string_view::npos; at = answer.find('\n', at + 1)) {
    if (answer.substr(at + 1).starts_with('\n')) return at + 2;
    if (answer.substr(at + 1).starts_with("\r\n")) return at + 3;
  }
  return std::string_view::npos;
}

/// As the parser wants it, where web servers of small devices are terse: lines end with CRLF, the status with a reason,
/// and no name of a header holds a blank.
std::string in_strict_form(std::string_view head) {
  std::string strict;
  for (std::size_t begin = 0; begin < head.size();) {
    const std::size_t end = head.find('\n', begin);
    std::string_view line = head.substr(begin, end - begin);
    begin = end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    const bool status = strict.empty();
    if (!status && line.substr(0, line.find(':')).find_first_of(" \t") != std::string_view::npos) continue;
    strict.append(line);
    if (status && std::ranges::count(line, ' ') == 1) strict += ' ';
    strict += "\r\n";
  }
  return strict;
}

/// Appends what comes next; false: the end. A body without a length may end with a reset as well.
bool receive(TcpClient& box, std::string& received, bool may_end) {
  try {
    return box.receive(received);
  } catch (const TcpError& error) {
    if (may_end && error.cause == TcpError::Cause::reset) return false;
    throw;
  }
}

/// The head in strict form, and the beginning of the body.
std::string read_head(TcpClient& box) {
  constexpr std::string_view kScheme = "HTTP/";
  std::string received;
  std::size_t end = std::string::npos;
  while (end == std::string::npos) {
    if (received.size() > kHeadLimit) throw kNotHttp;
    if (!box.receive(received)) throw received.empty() ? kNoWord : kCutShort;
    if (!kScheme.starts_with(received.substr(0, kScheme.size()))) throw kNotHttp;
    end = end_of_head(received);
  }
  return in_strict_form(received.substr(0, end)) + received.substr(end);
}

http::response<http::string_body> read_response(TcpClient& box) {
  http::response_parser<http::string_body> parser;
  parser.header_limit(kHeadLimit);
  parser.body_limit(kBodyLimit);
  std::string received = read_head(box);
  for (bool more = true; !parser.is_done(); more = parser.is_done() || receive(box, received, parser.need_eof())) {
    boost::system::error_code error;
    if (!more) parser.put_eof(error);
    while (!error && !received.empty() && !parser.is_done()) {
      // Before the header is done: an eager parser goes past a length above the limit, and makes room for all of it.
      parser.eager(parser.is_header_done());
      received.erase(0, parser.put(boost::asio::buffer(received), error));
    }
    refuse_if_wrong(error);
    if (parser.get().body().size() > kBodyLimit) throw kTooLong;
  }
  return parser.release();
}

std::string advice(const TcpError& error, const std::string& host, std::uint16_t port) {
  if (error.cause == TcpError::Cause::refused)
    return fmt::format("a device is at this address, but no web server on port {}: check the address and http_port",
                       port);
  if (error.cause == TcpError::Cause::no_such_address)
    return "bind in the bench file must be an address of this computer: `ip -4 address`";
  if (const std::string other = advice_to_reach(host, interfaces()); !other.empty()) return other;
  const std::string all = "check the address, the cable and the box's power";
  if (error.cause != TcpError::Cause::timeout) return all;
  return all + "; the box serves one connection at a time: close its web pages";
}

bool is_passing(unsigned status) {
  constexpr unsigned kTooManyRequests = 429, kUnavailable = 503;
  return status == kTooManyRequests || status == kUnavailable;
}

/// One connection. Throws Refused.
std::string ask(const Host& host, std::uint16_t port, const std::string& target, std::chrono::nanoseconds wall_timeout,
                int wanted_status) {
  TcpClient box(wall_timeout);
  try {
    box.connect(host, port);
    box.send(fmt::format("GET {} HTTP/1.0\r\nHost: {}\r\n\r\n", target, host.name));
    http::response<http::string_body> response = read_response(box);
    const unsigned status = response.result_int();
    if (static_cast<int>(status) == wanted_status) return std::move(response.body());
    const bool passing = is_passing(status);
    throw Refused{fmt::format("HTTP status {}", status),
                  passing ? kCloseOthers : "check that this is a Net Box: open the address in a browser", passing};
  } catch (const TcpError& error) {
    using Cause = TcpError::Cause;
    const double seconds = std::chrono::duration<double>(wall_timeout).count();
    throw Refused{error.cause == Cause::timeout
                      ? fmt::format("no answer within {:.1f} s (could not {})", seconds, box.step())
                      : fmt::format("could not {}: {}", box.step(), error.what()),
                  advice(error, host.name, port), error.cause == Cause::refused || error.cause == Cause::reset};
  }
}

}  // namespace

std::string http_get(const Host& host, std::uint16_t port, const std::string& target,
                     std::chrono::nanoseconds wall_timeout, int wanted_status, std::chrono::nanoseconds refused_for) {
  const auto begun = std::chrono::steady_clock::now();
  std::chrono::nanoseconds took{0};
  for (int times = 1;; ++times) {
    try {
      return ask(host, port, target, wall_timeout - took, wanted_status);
    } catch (const Refused& refused) {
      took = std::chrono::steady_clock::now() - begun + kPauseAfterRefusal;
      if (!refused.may_pass || took >= std::min(wall_timeout, refused_for)) {
        const double seconds = std::chrono::duration<double>(took - kPauseAfterRefusal).count();
        throw DeviceError(fmt::format("Net Box {}:{}", host.name, port), "GET " + target,
                          refused.cause + (times == 1 ? "" : fmt::format(", {} times in {:.1f} s", times, seconds)),
                          refused.next_move);
      }
    }
    std::this_thread::sleep_for(kPauseAfterRefusal);
  }
}

}  // namespace kphi::netbox
