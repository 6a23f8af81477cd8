// A connection to a SCPI instrument, one line out, at most one line back: over TCP, or over USB. Blocking; one thread
// at a time. Its address in a bench file:
//
//     scpi-tcp:192.168.1.30:5025
//     scpi-usb:VVVV:PPPP            then :SERIAL or @PORT if several are alike
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/last_word.hpp"
#include "base/tcp.hpp"
#include "drivers/usb/bus.hpp"

namespace kphi::scpi {

inline constexpr std::size_t kLongestAnswer = 65536;  ///< bytes; none that kphi asks for is longer

class Line {
 public:
  virtual ~Line() = default;
  /// Throws DeviceError: unplugged, no answer in time, malformed answer. After a failure the line recovers before the
  /// next call, so that a late answer never answers another query.
  virtual void write(std::string_view command) = 0;
  /// The answer without its end of line.
  [[nodiscard]] virtual std::string query(std::string_view command) = 0;
  [[nodiscard]] virtual const std::string& name() const noexcept = 0;
  /// This command to the `device`, for another process to say, and a question to be asked afterwards, where that
  /// process can read an answer; nullopt where only this process can speak.
  [[nodiscard]] virtual std::optional<LastWord> last_word(std::string_view, std::string_view,
                                                          const std::string&) const {
    return std::nullopt;
  }
};

/// A plain TCP connection, port 5025 by custom.
class Tcp final : public Line {
 public:
  /// Connects. Throws DeviceError.
  Tcp(std::string host, std::uint16_t port, std::chrono::milliseconds timeout = std::chrono::milliseconds(1000));

  /// After a failure the connection is closed, and late answers with it; the next call opens a new one.
  void write(std::string_view command) override;
  [[nodiscard]] std::string query(std::string_view command) override;
  [[nodiscard]] const std::string& name() const noexcept override { return name_; }
  [[nodiscard]] std::optional<LastWord> last_word(std::string_view command, std::string_view question,
                                                  const std::string& device) const override {
    LastWord word{device, LastWord::Wire::tcp, host_, port_, std::string(command) + "\n"};
    word.question = std::string(question) + "\n";
    return word;
  }

 private:
  void connect();
  void carry_out(std::string_view operation, auto&& work);
  [[noreturn]] void fail(std::string_view operation, const std::string& cause, const char* next_move);

  const std::string host_;
  const std::uint16_t port_;
  const std::chrono::milliseconds timeout_;
  const std::string name_;
  std::optional<TcpClient> connection_;
  std::string received_;
};

/// The Test and Measurement Class of USB with its USB488 subclass.
class Usbtmc : public Line {
 public:
  using Timeout = usb::Transport::Timeout;

  /// Claims the interface, clears the instrument's buffers, and puts it under remote control, unless it lacks that or
  /// is known to hang on it. Throws DeviceError: no such interface, does not answer. `transport` must outlive this.
  explicit Usbtmc(usb::Transport& transport, Timeout timeout = std::chrono::milliseconds(1000));

  void write(std::string_view command) override;
  [[nodiscard]] std::string query(std::string_view command) override;
  [[nodiscard]] const std::string& name() const noexcept override { return transport_.name(); }
  [[nodiscard]] std::optional<LastWord> last_word(std::string_view command, std::string_view question,
                                                  const std::string& device) const override;

 private:
  void find_endpoints();
  void read_capabilities();
  void take_remote_control();
  void clear();
  [[nodiscard]] bool receive_part(std::string& answer, bool may_be_empty);
  [[noreturn]] void recover_and_fail(const usb::Endpoint& endpoint, usb::Outcome outcome, std::string_view operation,
                                     const std::string& cause, const char* next_move = "");
  void abort(const usb::Endpoint& endpoint) noexcept;
  void drain() noexcept;
  [[noreturn]] void fail(std::string_view operation, const std::string& cause, const char* next_move = "");

  usb::Transport& transport_;
  const Timeout timeout_;
  std::uint8_t interface_ = 0;
  usb::Endpoint in_, out_;
  bool remote_local_ = false;  ///< RL1 of GET_CAPABILITIES (USBTMC 4.2.1.8, USB488 4.2.2): REN, go to local
  std::uint8_t tag_ = 0;
  bool out_of_order_ = false;  ///< clear before the next command
};

[[nodiscard]] bool is_scpi(std::string_view uri) noexcept;

/// Throws std::invalid_argument with one line that says what to write; DeviceError: not there, or not an instrument.
[[nodiscard]] std::unique_ptr<Line> open_line(const std::string& uri);

}  // namespace kphi::scpi
