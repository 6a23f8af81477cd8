// SCPI over USB: the Test and Measurement Class with its USB488 subclass.
#pragma once

#include <chrono>

#include "drivers/scpi/line.hpp"
#include "drivers/usb/transport.hpp"

namespace kphi::scpi {

class Usbtmc : public Line {
 public:
  using Timeout = usb::Transport::Timeout;

  /// Claims the interface, clears the instrument's buffers, and puts it under remote control, unless it lacks that or
  /// is known to hang on it. Throws DeviceError: no such interface, does not answer. `transport` must outlive this.
  explicit Usbtmc(usb::Transport& transport, Timeout timeout = std::chrono::milliseconds(1000));

  void write(std::string_view command) override;
  [[nodiscard]] std::string query(std::string_view command) override;
  [[nodiscard]] const std::string& name() const noexcept override { return transport_.name(); }
  [[nodiscard]] LineCounters counters() const noexcept override { return counters_; }

 private:
  void find_endpoints();
  void read_capabilities();
  void take_remote_control();
  void clear();
  [[nodiscard]] std::string receive(std::string_view command);
  [[nodiscard]] bool receive_part(std::string& answer, bool may_be_empty);
  void recover_out(usb::Outcome outcome) noexcept;
  void recover_in(usb::Outcome outcome) noexcept;
  [[nodiscard]] bool abort(std::uint8_t initiate, std::uint8_t check, const usb::Endpoint& endpoint) noexcept;
  void drain() noexcept;
  [[noreturn]] void fail(std::string_view operation, const std::string& cause, const char* next_move = "");

  usb::Transport& transport_;
  const Timeout timeout_;
  std::uint8_t interface_ = 0;
  usb::Endpoint in_, out_;
  bool remote_local_ = false;  ///< RL1 of GET_CAPABILITIES (USBTMC 4.2.1.8, USB488 4.2.2): REN, go to local
  std::uint8_t tag_ = 0;
  bool out_of_order_ = false;  ///< clear before the next command
  LineCounters counters_;
};

}  // namespace kphi::scpi
