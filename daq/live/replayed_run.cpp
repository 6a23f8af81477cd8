#include "daq/live/replayed_run.hpp"

#include <algorithm>
#include <thread>

#include "base/error.hpp"
#include "daq/guard/observation.hpp"

namespace kphi::daq::live {
namespace {

using results::Phase;
using Wall = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTickWall{10};
constexpr Duration kFresh = std::chrono::milliseconds(200);

/// Without limits if it cannot be read.
profiles::BenchConfig bench_of(const results::RunHeader& header) {
  try {
    return profiles::parse_bench(header.bench_text, "bench of the run");
  } catch (const ConfigurationError&) {
    return {};
  }
}

/// Mean of each axis before the motor turns, N and N m.
std::array<double, 6> zero_of(const results::RunRecording& recording) {
  std::array<double, 6> sum{};
  std::size_t n = 0;
  for (std::size_t i = 0; i + 1 < recording.phases.size(); ++i) {
    if (recording.phases[i].phase != Phase::zero_before) continue;
    for (const LoadCellRecord& sample : recording.load_cell) {
      if (sample.arrival_ns < recording.phases[i].time_ns || sample.arrival_ns >= recording.phases[i + 1].time_ns)
        continue;
      for (std::size_t axis = 0; axis < sum.size(); ++axis) sum[axis] += sample.counts[axis];
      ++n;
    }
  }
  const results::LoadCellScale& scale = recording.header.load_cell;
  for (std::size_t axis = 0; n > 0 && axis < sum.size(); ++axis)
    sum[axis] /= static_cast<double>(n) * (axis < 3 ? scale.counts_per_newton : scale.counts_per_newton_metre);
  return sum;
}

}  // namespace

Subject subject_of(const results::RunRecording& recording) {
  const results::RunHeader& header = recording.header;
  Subject subject;
  try {
    const DeviceLimits devices = device_limits(header);
    subject =
        subject_of(profiles::parse_campaign(header.campaign_text, "campaign of the run"), bench_of(header), &devices);
  } catch (const ConfigurationError&) {
    subject.name = header.campaign_name;
    subject.propeller = header.propeller_name;
    subject.minimum_discard = Seconds(header.minimum_discard_s);
    for (const auto& mark : recording.phases)
      subject.speed_max_rpm = std::max(subject.speed_max_rpm, to_rpm(RadPerSec(mark.speed_rad_s)));
  }
  subject.replay = true;
  std::erase_if(subject.limits, [](const GuardLimit& limit) {
    return row_of(limit.watched).source == Source::runner;
  });  // not recorded
  return subject;
}

ReplayedRun::ReplayedRun(const results::RunRecording& recording, ManualClock& clock)
    : recording_(recording),
      clock_(clock),
      motor_(recording.motor),
      observer_(
          {recording.header.thrust_axis, recording.header.thrust_sign, recording.header.spin, recording.header.blades},
          recording.header.load_cell, SpeedWatch(recording.header.spin, Duration(0))) {
  std::ranges::stable_sort(motor_, {}, &MotorReading::time_ns);
  const auto& cell = recording.load_cell;
  if (!cell.empty()) {
    begin_ = Instant(cell.front().arrival_ns);
    end_ = Instant(cell.back().arrival_ns);
  }
  observer_.begin(begin_);
  observer_.take_zero(zero_of(recording));
  position_.name(recording.header.propeller_id);
  position_.occlusion_deg = recording.header.occlusion_deg;
  position_.repetition = position_.repetitions = recording.header.repetition;
  for (const auto& mark : recording.phases) position_.steps = std::max(position_.steps, mark.step + 1);
  seen_.account = recording.account;
}

void ReplayedRun::observe(Instant when) {
  const auto& cell = recording_.load_cell;
  for (; sample_ < cell.size() && cell[sample_].arrival_ns <= when.count(); ++sample_) observer_.take(cell[sample_]);
  for (; reading_ < motor_.size() && motor_[reading_].time_ns <= when.count(); ++reading_)
    observer_.take(motor_[reading_]);
  const auto& supply = recording_.supply;
  for (; supply_ < supply.size() && supply[supply_].time_ns <= when.count(); ++supply_) observer_.take(supply[supply_]);
  const SampleAccount account = seen_.account;
  seen_ = daq::observe(observer_.readings(), when, {kFresh, kFresh}, clock_);
  seen_.account = account;
  seen_.account.received = sample_;
}

void ReplayedRun::report_phases(Instant when, Progress& progress) {
  for (; phase_ < recording_.phases.size() && recording_.phases[phase_].time_ns <= when.count(); ++phase_) {
    if (position_.step >= 0) progress.step_done(position_, seen_);
    const auto& mark = recording_.phases[phase_];
    observer_.take(mark);
    observer_.settles_until(
        mark.phase == Phase::ramp ? kNever : Instant(mark.time_ns) + from_seconds(recording_.header.minimum_discard_s));
    position_.step = mark.step;
    position_.phase = kPhaseWords[static_cast<std::size_t>(mark.phase)];
    position_.commanded = RadPerSec(mark.speed_rad_s);
  }
  for (; event_ < recording_.events.size() && recording_.events[event_].time_ns <= when.count(); ++event_) {
    const auto& event = recording_.events[event_];
    progress.say((is_of_motor(event.kind) ? "motor: " : "") + event.text);
  }
}

void ReplayedRun::show(Instant when, Progress& progress, double speed) {
  report_phases(when, progress);
  observe(when);
  clock_.set(when);
  position_.remaining_s = to_seconds(std::max(Duration(0), end_ - when)) / speed;
  position_.done = to_seconds(when - begin_) / to_seconds(std::max(Duration(1), end_ - begin_));
  progress.tick(position_, seen_);
}

bool play(const results::RunRecording& recording, ManualClock& clock, Progress& progress, double speed,
          const std::function<bool()>& stop_asked) {
  ReplayedRun run(recording, clock);
  const auto began = Wall::now();
  for (auto due = began;; due += kTickWall) {
    std::this_thread::sleep_until(due);
    if (stop_asked()) return false;
    const Instant when = run.begin() + from_seconds(std::chrono::duration<double>(Wall::now() - began).count() * speed);
    run.show(std::min(when, run.end()), progress, speed);
    if (when >= run.end()) return true;
  }
}

}  // namespace kphi::daq::live
