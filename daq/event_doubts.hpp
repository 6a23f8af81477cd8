// Which steps an event of the load cell's stream or of the motor module puts in doubt.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "results/records.hpp"
#include "results/step_mean.hpp"

namespace kphi::daq {

/// A doubt about everything from `begin` to `end`, bench time.
struct DoubtSpan {
  results::Nanoseconds begin = 0;
  results::Nanoseconds end = 0;
  results::Doubt doubt{};
};

/// One span per event that spoils or may spoil a measurement; a stall or a silence lasts until it ends, or for ever;
/// a change of the configuration concerns the whole run.
/// Not of reboots and ranges: the samples themselves show these.
[[nodiscard]] std::vector<DoubtSpan> doubt_spans(std::span<const results::StreamEvent> events);

/// The doubts of all spans that touch [begin, end).
[[nodiscard]] std::uint32_t doubts_within(std::span<const DoubtSpan> spans, results::Nanoseconds begin,
                                          results::Nanoseconds end);

/// When the box took up measuring again after it had repeated itself: its clock stood still until then.
[[nodiscard]] std::vector<results::Nanoseconds> stall_ends(std::span<const results::StreamEvent> events);

}  // namespace kphi::daq
