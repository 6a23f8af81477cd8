#include "test/soak/soak_lives.hpp"

#include <memory>

#include "test/dice.hpp"

namespace kphi::soak {
namespace {

constexpr int kMostLives = 4;

bool goes_on(const Evidence& evidence, test::Dice& dice) {
  if (!evidence.left || evidence.story.end == End::finished || evidence.mixture.life == kMostLives) return false;
  return evidence.cut_short() || dice.once_in(3);
}

}  // namespace

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
