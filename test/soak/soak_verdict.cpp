#include "test/soak/soak_verdict.hpp"

#include <boost/math/distributions/binomial.hpp>

#include "test/soak/verdict_checks.hpp"

namespace kphi::soak {

bool is_chance(std::uint64_t flagged, std::uint64_t clean) {
  if (clean == 0) return flagged == 0;
  const boost::math::binomial steps(static_cast<double>(clean), kFlaggedByChance);
  return flagged == 0 || boost::math::cdf(boost::math::complement(steps, static_cast<double>(flagged - 1))) > 1e-6;
}

Verdict judge(const Evidence& evidence) {
  Verdict verdict;
  const Reaches reaches(evidence.mixture.faults);
  check_account(evidence, verdict.wrong);
  check_motion(evidence, reaches, verdict.wrong);
  check_record(evidence, verdict.wrong);
  check_inheritance(evidence, verdict.wrong);
  check_status(evidence, reaches, verdict.wrong);
  check_absence(evidence, verdict.wrong);
  check_end(evidence, reaches, verdict.wrong);
  check_steps_of_runs(evidence, reaches, verdict);
  return verdict;
}

}  // namespace kphi::soak
