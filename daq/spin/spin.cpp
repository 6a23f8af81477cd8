#include "daq/spin/spin.hpp"

#include <cmath>

#include "daq/campaign/at_the_stand.hpp"
#include "daq/guard/cell_trust.hpp"
#include "results/reduction/reduction.hpp"
#include "results/run_reader.hpp"

namespace kphi::daq {
namespace {

constexpr int kTicks = 100;  // at a held speed, before its signs are judged

/// Tells once what the signs say.
class SignWatch final : public Progress {
 public:
  SignWatch(Progress& inner, int spin) : inner_(inner), spin_(spin) {}
  void guarded(const std::vector<GuardLimit>& limits) override { inner_.guarded(limits); }
  void tick(const Position& position, const Observation& seen) override {
    inner_.tick(position, seen);
    const bool holds = position.step >= 0 && position.phase.empty() && seen.load_cell_is_fresh();
    ticks_ = holds ? ticks_ + 1 : 0;
    if (ticks_ != kTicks || told_) return;
    if (const auto doubt = doubt_about_signs(seen.thrust_n, seen.torque_nm, spin_)) {
      told_ = true;
      inner_.say(*doubt);
    }
  }
  void step_done(const Position& position, const Observation& seen) override { inner_.step_done(position, seen); }
  void say(const std::string& line) override { inner_.say(line); }

 private:
  Progress& inner_;
  const int spin_;
  int ticks_ = 0;
  bool told_ = false;
};

std::shared_ptr<void> kept(std::shared_ptr<void> handle, const std::string& why_not, Progress& progress) {
  if (!why_not.empty()) progress.say(why_not);
  return handle;
}

}  // namespace

SpinResult spin_by_hand(const Spin& spin) {
  const MountConfirmation clear =
      ask_at_the_stand(spin.bench, spin.person, spin.stop_asked, [&](const StandAtRest& stand) {
        return spin.person.confirm_clear(to_rpm(spin.speeds.start), stand.condition() + about_keypad(spin.bench));
      });
  HandControl steering(spin.speeds, spin.keys);
  const StopAsked stop_asked = [&] { return spin.stop_asked() || steering.is_called_off(); };
  spin.bench.restore_power(stop_asked);
  profiles::PlannedRun planned;
  planned.mount = false;
  const double lasts_s = spin.speeds.lasts ? to_seconds(*spin.speeds.lasts) : 0;
  const RunOrder order{spin.campaign, spin.config, clear, planned, lasts_s, false, 0, spin.file, &steering};
  SignWatch watched(spin.progress, spin.config.iq.spin);
  std::string awake_not, prompt_not;
  const auto awake = kept(spin.bench.keep_awake(awake_not), awake_not, watched);
  (void)kept(spin.bench.keep_prompt(prompt_not), prompt_not, watched);  // only to tell a refusal
  RunResult run = record_run(spin.bench, order, watched, stop_asked);
  std::vector<results::StepMean> held = results::reduce(results::read_run(run.file));
  std::erase_if(held, [](const results::StepMean& step) { return !std::isfinite(step.thrust_n); });
  return {std::move(run), std::move(held)};
}

}  // namespace kphi::daq
