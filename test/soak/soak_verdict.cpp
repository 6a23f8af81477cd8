#include "test/soak/soak_verdict.hpp"

#include <boost/math/distributions/binomial.hpp>

#include "test/dice.hpp"
#include "test/soak/verdict_checks.hpp"

namespace kphi::soak {
namespace {

constexpr int kMostLives = 4;

bool goes_on(const Evidence& evidence, test::Dice& dice) {
  if (!evidence.left || evidence.story.end == End::finished || evidence.mixture.life == kMostLives) return false;
  return evidence.cut_short() || dice.once_in(3);
}

}  // namespace

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

void live_through(std::uint64_t seed, const std::function<void(const Evidence&, const Verdict&)>& judged) {
  test::Dice dice(~seed);
  Mixture mixture = draw(seed);
  auto world = std::make_unique<World>(mixture, quick_folder());
  for (;;) {
    world->live();
    const Evidence evidence = evidence_of(*world);
    const Verdict verdict = judge(evidence);
    judged(evidence, verdict);
    if (!verdict.wrong.empty() || !goes_on(evidence, dice)) return;
    mixture = draw_resumed(mixture);
    world = std::make_unique<World>(mixture, quick_folder(), *evidence.left);
  }
}

}  // namespace kphi::soak
