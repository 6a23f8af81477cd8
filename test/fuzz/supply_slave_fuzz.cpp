// The simulated supply meets any bytes, on a serial line and on TCP, of any model.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/sim/supply/slave.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kphi::sim;
  if (size < 2) return 0;
  SupplySettings settings;
  settings.model = std::string(supply_models()[data[0] % supply_models().size()].name);
  settings.replies_per_s = 0;
  SupplySlave slave(settings);
  const auto framing = data[1] % 2 == 0 ? ModbusFraming::rtu : ModbusFraming::tcp;
  kphi::Instant now{0};
  for (std::span rest(data + 2, size - 2); !rest.empty();) {
    const auto piece = rest.first(std::min<std::size_t>(rest.size(), 1 + data[1] / 2));
    rest = rest.subspan(piece.size());
    now += std::chrono::milliseconds(1);
    slave.receive(0, framing, piece, now);
    slave.advance({0, 0.1}, now);
    SupplyReply reply;
    while (slave.next_reply(reply, now)) {
      if (reply.bytes.size() > 260) __builtin_trap();
    }
  }
  return 0;
}
