#include "test/soak/absent_box.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>

#include "daq/virtual/deterministic_bench.hpp"
#include "test/dice.hpp"

namespace kphi::soak {
namespace {

using namespace std::chrono_literals;

constexpr double kBegins_s = 6;
/// The longest pause between two questions to a box that was away for up to 3 s, and the handshake.
constexpr Duration kPatience = 4s;

struct Kind {
  const char* faults;  ///< {0}: when it begins, {1}: how long it lasts; s
  bool returns, is_started;
};
constexpr std::array kKinds{
    Kind{"  - {{at_s: {0}, kind: reboot, down_s: {1:.3f}, resume: 0}}\n", true, true},
    Kind{"  - {{at_s: {0}, for_s: {1:.3f}, kind: loss, p: 1}}\n"
         "  - {{at_s: {0}, for_s: {1:.3f}, kind: http_refused}}\n",
         true, false},
    Kind{"  - {{at_s: {0}, kind: taken_over}}\n  - {{at_s: {0}, for_s: {1:.3f}, kind: http_refused}}\n", true, true},
    Kind{"  - {{at_s: {0}, for_s: {1:.3f}, kind: loss, p: 1}}\n", true, false},
    Kind{"  - {{at_s: {0}, kind: taken_over}}\n", false, false},
};

}  // namespace

std::optional<Absence> draw_absence(std::uint64_t seed) {
  test::Dice dice(seed + (std::uint64_t{99} << 40));
  if (!dice.once_in(4)) return std::nullopt;
  const Kind& kind = dice.one_of(kKinds);
  const double lasts_s = dice.real(1, 3);
  return Absence{"format: kphi-faults/1\nfaults:\n" + fmt::format(fmt::runtime(kind.faults), kBegins_s, lasts_s),
                 from_seconds(kBegins_s + lasts_s), kind.returns, kind.is_started};
}

Comeback live_through(const Absence& absence, const std::string& bench, std::uint64_t seed,
                      const std::filesystem::path& folder) {
  Comeback seen;
  try {
    std::ofstream(folder / "absence.yaml") << absence.faults;
    const std::string text =
        bench + fmt::format("simulation: {{in_process: true, seed: {}, faults: absence.yaml}}\n", seed);
    daq::DeterministicBench stand(profiles::parse_bench(text, (folder / "absence_bench.yaml").string()));
    daq::LoadCellLink& cell = stand.load_cell();
    (void)cell.start();
    std::vector<LoadCellRecord> records(4096);
    while (stand.clock().now() < absence.ends + kPatience) {
      stand.wait_until(stand.clock().now() + 50ms);
      while (const std::size_t count = cell.take(records)) seen.newest = Instant(records[count - 1].arrival_ns);
      for (const auto& event : cell.take_events()) seen.events.push_back(event.kind);
    }
    seen.ended = stand.clock().now();
    seen.failure = cell.failure();
    seen.starts = stand.simulation().wire().truth().starts;
    cell.stop();
  } catch (const std::exception& e) {
    seen.failure = e.what();
  }
  return seen;
}

}  // namespace kphi::soak
