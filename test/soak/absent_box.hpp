// A load cell that stops streaming in the middle of a stream and may come back: drawn from a seed, on a bench of its
// own with the motor at rest, so that the stream lives long enough to see the end of it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "results/records.hpp"

namespace kphi::soak {

struct Absence {
  std::string faults;  ///< YAML: the whole fault script
  Instant ends{0};     ///< from then on the box answers, or its datagrams arrive again
  bool returns = true;
  bool is_started = true;  ///< kphi must start the stream again; else it continues by itself
};

/// The stream as kphi saw it.
struct Comeback {
  std::vector<EventKind> events;
  Instant newest{0}, ended{0};  ///< arrival of the newest sample; end of the stream
  std::uint64_t starts = 0;     ///< requested by kphi
  std::string failure;          ///< LoadCellLink::failure() at the end, or the exception
};

/// One seed in four has one.
[[nodiscard]] std::optional<Absence> draw_absence(std::uint64_t seed);
/// `bench`: YAML without the simulation. Files go to `folder`.
[[nodiscard]] Comeback live_through(const Absence& absence, const std::string& bench, std::uint64_t seed,
                                    const std::filesystem::path& folder);

}  // namespace kphi::soak
