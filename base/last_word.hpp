// What another process shall say to a device once this one has died: the bytes, and where they go.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kphi {

struct LastWord {
  enum class Wire : std::uint8_t { udp, tcp, serial, usb };
  std::string device;  ///< for messages: "supply RD6024 on /dev/ttyUSB1"
  Wire wire = Wire::udp;
  std::string where;    ///< host, or path of the serial port, or of the device on USB
  unsigned number = 0;  ///< port, or baud, or of a USBTMC instrument: interface + 256 · endpoint of its messages
  std::string bytes;
  std::string answer{};  ///< bytes that the device answers with; empty: it does not answer
  std::string from{};    ///< own address to speak from; empty: as the kernel routes
  /// Asks whether it has obeyed, and the answers that say so; empty: it cannot be asked.
  std::string question{};
  std::vector<std::string> proofs{};
  std::string lock{};  ///< file whose lock the device's user holds; whoever has it by then is not disturbed
};

}  // namespace kphi
