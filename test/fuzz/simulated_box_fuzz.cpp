// Any requests to the simulated bench: RDT datagrams, pages and writes over HTTP, commands over TCP, lines of the
// control socket. It answers or ignores, keeps within its own limits and sends whole records only.
// Input: pieces of one byte kind, one byte length and as many bytes.
#include <cstdlib>
#include <span>
#include <string>

#include "drivers/sim/control_line.hpp"
#include "drivers/sim/simulated_bench.hpp"
#include "test/fuzz/tokens.hpp"

namespace {

using namespace std::string_view_literals;
using namespace kphi;

constexpr std::string_view kTokens[] = {
    "\0\x08\x12\x34\0\x02\0\0\0\0"sv,
    "\0\x08\x12\x34\0\x03\0\0\0\0"sv,
    "\0\x08\x12\x34\0\x03\0\0\0\x05"sv,
    "\0\x08\x12\x34\0\x42\0\0\0\0"sv,
    "\0\x08\x12\x34\0\x41\0\0\0\0"sv,
    "\0\x08\x12\x34\0\x04\0\0\0\0"sv,
    "\0\x08\x12\x34\0\0\0\0\0\0"sv,
    "\x02\x14\x01\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0"sv,
    "\x02\x14\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\xff\xff\0\x03"sv,
    "\x01\x20GET /comm.cgi?comrdtrate=1000 HTT"sv,
    "\x01\x20GET /netftapi2.xml?index=15 HTTP/"sv,
    "\x01\x20GET /netftcalapi.xml?index=1 HTTP"sv,
    "\x01\x20GET /setting.cgi?setuserfilter=9 "sv,
    "\x03\x0bmount 5x3 90"sv,
    "\x03\x06status"sv,
    "&comrdtbsiz="sv,
    "&setcfgsel="sv,
    "1e308"sv,
    "-2147483649"sv,
};

void require(bool condition) {
  if (!condition) std::abort();
}

void require_sane(const sim::NetBoxDevice& box) {
  const sim::NetBoxSettings& settings = box.settings();
  require(box.divisor() >= 1 && box.divisor() <= 7000);
  require(settings.records_per_datagram >= 1 && settings.records_per_datagram <= 40);
  require(settings.active_slot >= 0 && settings.active_slot < sim::kSlots);
  require(settings.filter >= 0 && settings.filter < static_cast<int>(sim::kFilterCutoffsHz.size()));
}

void take_datagrams(sim::SimulatedBench& bench, Instant now) {
  sim::Datagram datagram;
  while (bench.wire().next_datagram(datagram, now))
    require(datagram.size > 0 && datagram.size % sim::kRecordBytes == 0 && datagram.size <= 40 * sim::kRecordBytes);
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max, unsigned seed) {
  return kphi::test::mutate_with(kTokens, data, size, max, seed);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::span<const std::uint8_t> input(data, size);
  sim::SimulatedBench bench{sim::BenchSettings{}};
  std::string over_tcp;
  Instant now{0};
  while (input.size() >= 2) {
    const unsigned kind = input[0] % 5;
    const std::size_t wanted = input[1];
    input = input.subspan(2);
    const auto bytes = input.first(std::min(wanted, input.size()));
    input = input.subspan(bytes.size());
    const std::string text(bytes.begin(), bytes.end());
    if (kind == 0) bench.wire().request(bytes, 7, now);
    if (kind == 1) require(bench.wire().http(text, now).bytes.starts_with("HTTP/1.0 "));
    if (kind == 2) {
      over_tcp += text;
      require(bench.wire().tcp(over_tcp, now).bytes.size() % 4 == 0);
      require(over_tcp.size() < 20);
    }
    if (kind == 3) require(!sim::control_answer(bench, text).empty());
    bench.advance(now += kind == 4 ? std::chrono::microseconds(100 * wanted) : std::chrono::microseconds(300));
    take_datagrams(bench, now);
    require_sane(bench.netbox());
  }
  return 0;
}
