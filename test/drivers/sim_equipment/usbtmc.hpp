// A simulated instrument on USB: the Test and Measurement Class with its USB488 subclass, written from the class's
// tables, without a line of the driver's.
#pragma once

#include <deque>
#include <mutex>
#include <vector>

#include "drivers/sim/script/faults.hpp"
#include "drivers/sim/usb/function.hpp"
#include "test/drivers/sim_equipment/scpi_instrument.hpp"

namespace kphi::sim {

/// What an instrument has been made to bear.
struct UsbtmcTruth {
  std::uint64_t messages = 0, requests = 0;
  std::uint64_t malformed = 0;    ///< transfers that are none of the class's; each halts the endpoint
  std::uint64_t interrupted = 0;  ///< answers that nobody had fetched when the next message came
  std::uint64_t aborts = 0, clears = 0;
  std::uint64_t remote = 0;  ///< times it was put under remote control
};

struct UsbtmcType {
  std::uint16_t vendor = 0x1209, product = 0x5C91;
  std::string serial = "SN0001";
  bool chokes_on_remote = false;  ///< claims RL1, and once it was sent REN answers nothing any more
  bool remote_local = true;       ///< RL1
};

class Usbtmc final : public UsbFunction {
 public:
  /// `instrument` and `faults` must outlive this.
  Usbtmc(ScpiInstrument& instrument, UsbFaults& faults, UsbtmcType type = {});

  const UsbShape& shape() const noexcept override { return shape_; }
  UsbAnswer control(const UsbSetup& setup, std::span<const std::uint8_t> out) override;
  UsbAnswer out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) override;
  UsbAnswer in(std::uint8_t endpoint, std::size_t at_most) override;
  void halt_cleared(std::uint8_t endpoint) override;

  /// Any thread.
  [[nodiscard]] UsbtmcTruth truth() const;

 private:
  struct Packet {
    std::vector<std::uint8_t> bytes;
    Instant due{0};
  };

  UsbAnswer capabilities() const;
  UsbAnswer take_remote(const UsbSetup& setup);
  UsbAnswer initiate_abort(const UsbSetup& setup, bool in);
  UsbAnswer check_abort();
  UsbAnswer initiate_clear();
  UsbAnswer check_clear();
  bool take_message(std::span<const std::uint8_t> bytes);
  void answer_request(std::uint8_t tag, std::size_t at_most);
  void drop_answers();

  const UsbtmcType type_;
  const UsbShape shape_;
  ScpiInstrument& instrument_;
  UsbFaults& faults_;
  mutable std::mutex mutex_;
  std::string message_;  ///< gathered until its end
  std::string answer_;   ///< not yet asked for
  std::deque<Packet> packets_;
  std::uint8_t last_out_tag_ = 0, last_in_tag_ = 0;
  bool asked_ = false;  ///< a request is under way
  int still_pending_ = 0;
  bool out_halted_ = false, in_halted_ = false;
  bool choked_ = false;
  UsbtmcTruth truth_;
};

}  // namespace kphi::sim
