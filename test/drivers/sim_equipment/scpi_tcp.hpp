// A simulated instrument on a plain TCP connection: one line there, at most one line back.
#pragma once

#include <cstdint>
#include <list>
#include <string>
#include <thread>

#include "drivers/sim/transport/conversations.hpp"
#include "drivers/sim/usb/function.hpp"
#include "test/drivers/sim_equipment/scpi_instrument.hpp"

namespace kphi::sim {

/// Serves on 127.0.0.1 while it lives, on a thread of its own. Of the faults it knows no_reply, late and closed.
class ScpiTcp {
 public:
  /// `instrument` and `faults` must outlive this; port 0: any free one. Throws DeviceError.
  ScpiTcp(ScpiInstrument& instrument, UsbFaults& faults, std::uint16_t port = 0);
  ~ScpiTcp();
  ScpiTcp(const ScpiTcp&) = delete;
  ScpiTcp& operator=(const ScpiTcp&) = delete;

  [[nodiscard]] std::uint16_t port() const noexcept { return listening_.port; }

 private:
  struct Client {
    Descriptor socket;
    std::string received;
    std::list<std::pair<Instant, std::string>> answers;
  };

  void run() noexcept;
  void accept();
  [[nodiscard]] bool hear(Client& client);
  [[nodiscard]] bool apply(Client& client, const std::string& line);
  void answer(Client& client);
  [[nodiscard]] int patience_ms() const;

  ScpiInstrument& instrument_;
  UsbFaults& faults_;
  Listening listening_;
  Descriptor wake_;
  std::list<Client> clients_;
  std::thread thread_;
};

}  // namespace kphi::sim
