#include "base/tcp.hpp"

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/impl/src.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/src.hpp>

namespace kphi {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;
using Cause = TcpError::Cause;

}  // namespace

template <class Start>
std::size_t TcpClient::carry_out(const char* step, Start&& start) {
  step_ = step;
  error_code error;
  std::size_t count = 0;
  start([&](error_code result, std::size_t size) {
    error = result;
    count = size;
  });
  io_.restart();
  io_.run();
  if (error == boost::beast::error::timeout) throw TcpError(Cause::timeout, "no answer in time");
  const bool refused = error == asio::error::connection_refused, reset = error == asio::error::connection_reset;
  if (error && error != asio::error::eof)
    throw TcpError(refused ? Cause::refused : reset ? Cause::reset : Cause::other, error.message());
  return count;
}

void TcpClient::connect(const Host& host, std::uint16_t port) {
  error_code error;
  const auto addresses = asio::ip::tcp::resolver(io_).resolve(host.name, std::to_string(port), error);
  if (error) throw TcpError(Cause::unknown_name, error.message());
  if (host.from.empty()) {
    carry_out("connect", [&](auto done) {
      stream_.async_connect(addresses, [done](error_code result, const auto&) mutable { done(result, 0); });
    });
    return;
  }
  const asio::ip::tcp::endpoint to = *addresses.begin();
  const asio::ip::address own = asio::ip::make_address(host.from, error);
  auto& socket = stream_.socket();
  if (!error) socket.open(to.protocol(), error);
  if (!error) socket.bind({own, 0}, error);
  if (error) throw TcpError(Cause::no_such_address, "cannot speak from " + host.from + ": " + error.message());
  carry_out("connect",
            [&](auto done) { stream_.async_connect(to, [done](error_code result) mutable { done(result, 0); }); });
}

void TcpClient::send(std::string_view bytes) {
  carry_out("send the request",
            [&](auto done) { asio::async_write(stream_, asio::buffer(bytes.data(), bytes.size()), done); });
}

bool TcpClient::receive(std::string& to) {
  std::array<char, 4096> bytes;
  const std::size_t received =
      carry_out("read the answer", [&](auto done) { stream_.async_read_some(asio::buffer(bytes), done); });
  to.append(bytes.data(), received);
  return received > 0;
}

}  // namespace kphi
