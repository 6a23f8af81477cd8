// The parts of judge(): each appends one line for whatever is not as soak_verdict.hpp says.
#pragma once

#include <string>
#include <vector>

#include "test/soak/evidence.hpp"
#include "test/soak/fault_reach.hpp"
#include "test/soak/soak_verdict.hpp"

namespace kphi::soak {

using Lines = std::vector<std::string>;

/// From a sample beyond a limit to the coast at most; of a module that hears nothing: by its own timeout.
inline constexpr Duration kHeard = std::chrono::milliseconds(50), kOwnTimeout = std::chrono::milliseconds(600);

void check_account(const Evidence& evidence, Lines& wrong);
void check_motion(const Evidence& evidence, const Reaches& reaches, Lines& wrong);
void check_record(const Evidence& evidence, Lines& wrong);
void check_inheritance(const Evidence& evidence, Lines& wrong);
/// What was done about a box that reported an error.
void check_status(const Evidence& evidence, const Reaches& reaches, Lines& wrong);
/// Whether the stream of an absent box came back, and only when it should.
void check_absence(const Evidence& evidence, Lines& wrong);
/// Why the campaign ended.
void check_end(const Evidence& evidence, const Reaches& reaches, Lines& wrong);
/// What the runs of this life tell of their steps and of the air. Counts the clean ones, too.
void check_steps_of_runs(const Evidence& evidence, const Reaches& reaches, Verdict& verdict);

}  // namespace kphi::soak
