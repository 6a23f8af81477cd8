#include "drivers/netbox/configuration/http.hpp"

#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <utility>

#include "base/error.hpp"

namespace kphi::netbox {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using boost::system::error_code;

constexpr std::uint64_t kBodyLimit = 1 << 20;

/// One request on its way through resolve, connect, write, read; `step_` says where it is or where it ended.
class Exchange {
 public:
  Exchange(asio::io_context& io, const std::string& host, const std::string& target)
      : resolver_(io), stream_(io), request_(http::verb::get, target, 10) {
    request_.set(http::field::host, host);
    parser_.body_limit(kBodyLimit);
  }

  void begin(const std::string& host, std::uint16_t port) {
    resolver_.async_resolve(host, std::to_string(port), [this](error_code error, auto endpoints) {
      if (!proceed(error, "connect")) return;
      stream_.async_connect(endpoints, [this](error_code failure, const auto&) {
        if (!proceed(failure, "send the request")) return;
        write();
      });
    });
  }

  [[nodiscard]] bool done() const { return done_; }
  [[nodiscard]] error_code error() const { return error_; }
  [[nodiscard]] const std::string& step() const { return step_; }
  [[nodiscard]] http::response<http::string_body>& response() { return parser_.get(); }

 private:
  void write() {
    http::async_write(stream_, request_, [this](error_code error, std::size_t) {
      if (!proceed(error, "read the answer")) return;
      // The headers by themselves: with the body behind them, Beast 1.74 forgets that they announce too long a one.
      http::async_read_header(stream_, buffer_, parser_, [this](error_code failure, std::size_t) {
        if (proceed(failure, "read the answer")) read_body();
      });
    });
  }

  void read_body() {
    http::async_read(stream_, buffer_, parser_, [this](error_code error, std::size_t) {
      error_ = error;
      done_ = true;
    });
  }

  bool proceed(error_code error, const char* next) {
    error_ = error;
    if (error) {
      done_ = true;
    } else {
      step_ = next;
    }
    return !error;
  }

  asio::ip::tcp::resolver resolver_;
  beast::tcp_stream stream_;
  http::request<http::empty_body> request_;
  beast::flat_buffer buffer_;
  http::response_parser<http::string_body> parser_;
  std::string step_ = "look up the name";
  error_code error_;
  bool done_ = false;
};

std::string advice(const error_code& error, std::uint16_t port) {
  if (error == asio::error::connection_refused)
    return fmt::format("something is at this address, but no web server on port {}: check the address and http_port",
                       port);
  if (error == http::error::body_limit) return "this is no Net Box: check the address";
  if (error == http::error::partial_message || error == http::error::end_of_stream)
    return "the box broke off; try again, then power-cycle the box";
  if (error.category() == http::make_error_code(http::error::bad_version).category())
    return "this is no Net Box: check the address and http_port";
  return "check the address, the cable and the box's power";
}

/// Blocks until the whole answer is there. Throws DeviceError when it does not come or has another status.
http::response<http::string_body> exchanged(const std::string& host, std::uint16_t port, const std::string& target,
                                            std::chrono::nanoseconds wall_timeout, http::status demanded) {
  const std::string device = fmt::format("Net Box {}:{}", host, port);
  const std::string operation = "GET " + target;
  asio::io_context io;
  Exchange exchange(io, host, target);
  exchange.begin(host, port);
  io.run_for(wall_timeout);
  if (!exchange.done()) {
    throw DeviceError(
        device, operation,
        fmt::format("no answer within {:.1f} s (could not {})", std::chrono::duration<double>(wall_timeout).count(),
                    exchange.step()),
        "check the address, the cable and the box's power; the box serves one connection at a time: close "
        "its web pages");
  }
  if (exchange.error()) {
    throw DeviceError(device, operation, fmt::format("could not {}: {}", exchange.step(), exchange.error().message()),
                      advice(exchange.error(), port));
  }
  if (exchange.response().result() != demanded) {
    throw DeviceError(device, operation, fmt::format("HTTP status {}", exchange.response().result_int()),
                      "is this a Net Box? Open the address in a browser");
  }
  return std::move(exchange.response());
}

}  // namespace

std::string http_get(const std::string& host, std::uint16_t port, const std::string& target,
                     std::chrono::nanoseconds wall_timeout) {
  return std::move(exchanged(host, port, target, wall_timeout, http::status::ok).body());
}

void http_write(const std::string& host, std::uint16_t port, const std::string& target,
                std::chrono::nanoseconds wall_timeout) {
  (void)exchanged(host, port, target, wall_timeout, http::status::found);
}

}  // namespace kphi::netbox
