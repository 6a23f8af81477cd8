// Any bytes, in any chunks: the parser must account for each byte, and a session fed with them, alone or
// between the true answers of a module, may never move a motor.
#include <cstdlib>

#include "drivers/iq/session/session.hpp"
#include "test/drivers/iq/fake_module.hpp"

namespace {

void require(bool condition) {
  if (!condition) std::abort();
}

void parse(std::span<const std::uint8_t> bytes, std::size_t chunk) {
  kphi::iq::Parser parser;
  std::uint64_t in_packets = 0;
  const auto sink = [&](const kphi::iq::Packet& packet, std::uint64_t) {
    require(packet.length <= kphi::iq::kMaxPayload);
    in_packets += packet.length + kphi::iq::kFrameOverhead;
  };
  for (std::size_t at = 0; at < bytes.size(); at += chunk) {
    parser.push(bytes.subspan(at, std::min(chunk, bytes.size() - at)), sink);
  }
  while (parser.partial()) parser.abandon(sink);
  require(parser.counters().bytes_in == bytes.size());
  require(parser.counters().discarded_bytes + in_packets == bytes.size());
}

void converse(std::span<const std::uint8_t> bytes, std::size_t chunk) {
  kphi::iq::Session session{kphi::iq::Settings{}};
  kphi::Instant now{0};
  session.connect(now);
  for (std::size_t at = 0; at < bytes.size(); at += chunk) {
    session.receive(bytes.subspan(at, std::min(chunk, bytes.size() - at)), now);
    session.sent(session.output().size());
    now = std::max(now + std::chrono::milliseconds(1), std::min(session.deadline(), now + std::chrono::seconds(1)));
    session.advance(now);
    require(session.deadline() > now);
    require(!session.spinning());
  }
}

/// The bytes come between the true answers of a module: once connected it must stay still as well, and nothing may ever
/// be saved.
void disturb(std::span<const std::uint8_t> bytes, std::size_t chunk) {
  kphi::iq::Session session{kphi::iq::Settings{}};
  kphi::Instant now{0};
  kphi::iq::fake::Module module([&] { return now; });
  session.connect_anew(now);
  std::size_t at = 0;
  for (int turn = 0; turn < 400; ++turn) {
    const auto sent = session.output();
    const std::vector<std::uint8_t> heard(sent.begin(), sent.end());
    session.sent(heard.size());
    for (const auto& reply : module.receive(heard)) session.receive(reply, now);
    if (turn > 100 && at < bytes.size()) {
      session.receive(bytes.subspan(at, std::min(chunk, bytes.size() - at)), now);
      at += chunk;
    }
    now = std::max(now + std::chrono::microseconds(100), std::min(session.deadline(), now + std::chrono::seconds(1)));
    session.advance(now);
    require(session.deadline() > now);
  }
  require(module.count([](const auto& h) { return h.is_motion() && !h.is_coast(); }) == 0);
  require(module.count([](const auto& h) { return h.access == 2; }) == 0);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const std::size_t chunk = data[0] % 70 + 1;
  parse({data + 1, size - 1}, chunk);
  converse({data + 1, size - 1}, chunk);
  if (data[0] >= 210) disturb({data + 1, size - 1}, chunk);  // takes a hundred times as long
  return 0;
}
