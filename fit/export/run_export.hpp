// The samples of one run as files for other programs. Each function returns the values that its format cannot store.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "results/records.hpp"

namespace kphi::fit {

/// Topics /load_cell (N, N m), /motor/<channel> and /phase at their times since 1970; a sample of the load cell at its
/// own, by the box's clock (results::sample_times).
std::vector<std::string> run_to_mcap(const results::RunRecording& run, std::ostream& out);

/// time_s,force_x_n,…,torque_z_nm,ft_sequence,status: the load cell alone, each sample at its own time.
std::vector<std::string> run_to_csv(const results::RunRecording& run, std::ostream& out);

/// "2021-05-30T08:00:00Z" in ns since 1970, UTC; 0 for any other text.
[[nodiscard]] std::uint64_t nanoseconds_since_1970(const std::string& utc);

}  // namespace kphi::fit
