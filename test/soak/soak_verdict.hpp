// What must be true of every campaign, whatever went wrong in it: what is false is told, one line each.
//
// Account   Every record in a run's file is one that the box sent and that reached the stream's session, in order and
//           with its arrival; all numbers of the account are those of a perfect driver; received + lost = expected.
// Motion    At every prompt the motor coasts and stands. From the last look that found all well, the power stage is
//           open within 50 ms where the module could hear, within 0.6 s where only its own timeout was left; likewise
//           after a kill. While it drives, a record of the load cell has arrived within the last 0.25 s, or 0.6 s more
//           where no order could reach the module.
// Status    A box that reports an error in more samples on end than a datagram holds stops the run, with the motor or
//           without: the power stage is open within 50 ms of the first sample too many, or as above where no order
//           could reach the module.
// Absence   A box that reboots, cannot be reached or loses its datagrams for 1 to 3 s streams again within 4 s after it
//           is back, samples flow, and an event says so. A stream that another client has taken is left alone.
// Record    The folder verifies; aborted runs are whole and say why; steps.csv is the reduction of the accepted runs.
//           After a kill or with a refusing disk: all accepted runs are whole, the journal's chain is right, what was
//           secured can be read (unless the kill fell into a write), and at most one run is finished that the journal
//           does not know yet. Finished, all runs of the plan are accepted, each once.
// Resumed   Every run that was accepted before is there, byte by byte; whatever else was there is, at most with another
//           name; the journal goes on where it ended. Refused because of other faults, nothing has been touched.
// Verdict   A step without a flag shows the true thrust and speed. A step in whose window a record is missing, or in
//           which the box stood still, was saturated or reported an error, says so. A run out of reach of every fault
//           is accepted without a flag, but for those that short steps may have: the lag unknown; now and then
//           unsettled, drifting, or with a lag that is not there, which are counted; those of a speed that truly came
//           late. Nothing but a fault, the disk or the operator ends a campaign; the reason names the device concerned.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "test/soak/evidence.hpp"

namespace kphi::soak {

struct Verdict {
  std::vector<std::string> wrong;
  std::uint64_t clean_steps = 0;          ///< out of reach of every fault
  std::uint64_t clean_steps_flagged = 0;  ///< of them, by chance: unsettled, drifting, or a lag told that is not there
};

[[nodiscard]] Verdict judge(const Evidence& evidence);

/// Of clean steps, the share that their tests of significance flag although nothing is wrong with them: 105 of 40,383
/// were seen.
inline constexpr double kFlaggedByChance = 0.003;
/// So many of them, or more, would be flagged at least once in a million times.
[[nodiscard]] bool is_chance(std::uint64_t flagged, std::uint64_t clean);

/// A campaign through all its lives: whatever ended one of them, somebody may go on with what it left.
/// Lives the campaign of `seed` and judges it; then, as long as nothing is wrong, resumes it: always when it was killed
/// or its disk had refused, now and then after another end, until it is finished or four times in all. `judged` is
/// called for each life. Deterministic.
void live_through(std::uint64_t seed, const std::function<void(const Evidence&, const Verdict&)>& judged);

}  // namespace kphi::soak
