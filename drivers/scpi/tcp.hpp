// SCPI over a plain TCP connection, port 5025 by custom.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <chrono>
#include <cstdint>
#include <optional>

#include "drivers/scpi/line.hpp"

namespace kphi::scpi {

class Tcp final : public Line {
 public:
  /// Connects. Throws DeviceError.
  Tcp(std::string host, std::uint16_t port, std::chrono::milliseconds timeout = std::chrono::milliseconds(1000));

  /// After a failure the connection is closed, and late answers with it; the next call opens a new one.
  void write(std::string_view command) override;
  [[nodiscard]] std::string query(std::string_view command) override;
  [[nodiscard]] const std::string& name() const noexcept override { return name_; }
  [[nodiscard]] LineCounters counters() const noexcept override { return counters_; }

 private:
  void connect();
  template <class Start>
  void carry_out(std::string_view operation, Start&& start);
  [[noreturn]] void fail(std::string_view operation, const std::string& cause, const char* next_move);

  const std::string host_;
  const std::uint16_t port_;
  const std::chrono::milliseconds timeout_;
  const std::string name_;
  boost::asio::io_context io_{1};
  std::optional<boost::beast::tcp_stream> stream_;
  std::string received_;
  bool connected_before_ = false;
  LineCounters counters_;
};

}  // namespace kphi::scpi
