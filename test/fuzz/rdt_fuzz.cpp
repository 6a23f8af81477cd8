// Any sequence of datagrams into the decoder and the session: the account closes, nothing else gives way.
// Input: pieces of two bytes length (modulo 1500) and as many bytes; length 1 starts the stream anew.
#include <cstdlib>
#include <span>
#include <vector>

#include "drivers/netbox/stream/session.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kphi;
  using namespace kphi::netbox;
  std::span<const std::uint8_t> input(data, size);
  Session session{StreamSettings{}};
  std::vector<LoadCellRecord> accepted;
  Instant now{0};
  session.start(now);
  session.advance(now = session.deadline());
  while (input.size() >= 2) {
    const std::size_t wanted = (input[0] << 8 | input[1]) % 1500u;
    now += std::chrono::milliseconds(input[1] % 8);
    input = input.subspan(2);
    const auto datagram = input.first(wanted < input.size() ? wanted : input.size());
    input = input.subspan(datagram.size());
    session.advance(now);
    if (wanted == 1) session.start(now);
    session.note_host_drops(datagram.size() % 7);
    session.receive(datagram, now, accepted);
  }
  const Counters& counters = session.counters();
  if (counters.expected != counters.received + counters.lost_network + counters.lost_host) std::abort();
  if (counters.received != accepted.size()) std::abort();
  return 0;
}
