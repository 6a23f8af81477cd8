#include "drivers/scpi/tcp.hpp"

#include <fmt/format.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/error.hpp>

#include "base/error.hpp"

namespace kphi::scpi {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::size_t kLongestAnswer = 65536;

}  // namespace

Tcp::Tcp(std::string host, std::uint16_t port, std::chrono::milliseconds timeout)
    : host_(std::move(host)), port_(port), timeout_(timeout), name_(fmt::format("instrument {}:{}", host_, port)) {
  connect();
}

void Tcp::connect() {
  if (connected_before_) ++counters_.recoveries;
  stream_.emplace(io_);
  received_.clear();
  carry_out("connect", [this](auto&& done) {
    error_code unknown;
    asio::ip::tcp::resolver resolver(io_);
    const auto endpoints = resolver.resolve(host_, std::to_string(port_), unknown);
    if (unknown) return done(unknown, 0);
    stream_->async_connect(endpoints, [done](error_code error, const auto&) mutable { done(error, 0); });
  });
  connected_before_ = true;
}

void Tcp::write(std::string_view command) {
  if (!stream_) connect();
  const std::string line = std::string(command) + "\n";
  carry_out(command, [&](auto&& done) { asio::async_write(*stream_, asio::buffer(line), done); });
}

std::string Tcp::query(std::string_view command) {
  ++counters_.queries;
  if (!received_.empty()) {
    // Unrequested bytes: they are not the answer to this query.
    ++counters_.damaged;
    stream_.reset();
  }
  write(command);
  carry_out(command, [this](auto&& done) {
    asio::async_read_until(*stream_, asio::dynamic_buffer(received_, kLongestAnswer), '\n', done);
  });
  const std::size_t end = received_.find('\n');
  std::string answer = received_.substr(0, end);
  received_.erase(0, end + 1);
  while (!answer.empty() && answer.back() == '\r') answer.pop_back();
  return answer;
}

template <class Start>
void Tcp::carry_out(std::string_view operation, Start&& start) {
  error_code result;
  stream_->expires_after(timeout_);
  start([&result](error_code error, std::size_t) { result = error; });
  io_.restart();
  io_.run();
  if (!result) return;
  if (result == boost::beast::error::timeout) {
    ++counters_.timeouts;
    fail(operation, "no answer in time", "check that the instrument knows this command");
  }
  if (result == asio::error::not_found) {
    ++counters_.damaged;
    fail(operation, "the answer does not end", "");
  }
  fail(operation, result.message(), "check its power and its network address");
}

void Tcp::fail(std::string_view operation, const std::string& cause, const char* next_move) {
  stream_.reset();
  throw DeviceError(name_, std::string(operation), cause, next_move);
}

}  // namespace kphi::scpi
