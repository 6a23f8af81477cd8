#include "compensation/flight/flight.hpp"

#include <algorithm>
#include <stdexcept>

#include "compensation/flight/simulated_vehicle.hpp"

namespace kphi::flight {
namespace {

constexpr double kLostMetres = 1.0;

/// Sums over the part of a leg that counts.
class LegSums {
 public:
  void add(const Reference& reference, const BodyMotion& estimate, const AircraftState& state) noexcept {
    const Eigen::Vector3d error = reference.position - estimate.position;
    const double distance = error.norm();
    const auto rotors = state.rotors();
    ++count_;
    sums_.mean_error += error;
    sums_.mean_error_rate += reference.velocity - estimate.velocity;
    sums_.mean_distance += distance;
    square_distance_ += distance * distance;
    sums_.mean_square_speed += rotors.squaredNorm() / 4;
    sums_.fastest = std::max(sums_.fastest, rotors.maxCoeff());
  }
  [[nodiscard]] LegResult result() const noexcept {
    LegResult found = sums_;
    found.mean_error /= count_;
    found.mean_error_rate /= count_;
    found.mean_distance /= count_;
    found.mean_square_speed /= count_;
    found.deviation = std::sqrt(std::max(0.0, square_distance_ / count_ - found.mean_distance * found.mean_distance));
    return found;
  }

 private:
  double count_ = 0, square_distance_ = 0;
  LegResult sums_;  ///< of what it will hold the means
};

Eigen::Vector3d roll_pitch_yaw(const Eigen::Quaterniond& q) noexcept {
  const Eigen::Matrix3d r = q.toRotationMatrix();
  return {std::atan2(r(2, 1), r(2, 2)), std::asin(std::clamp(-r(2, 0), -1.0, 1.0)), std::atan2(r(1, 0), r(0, 0))};
}

/// For one call of run(). The first four members are what it works with.
struct Flight {
  const Experiment& experiment_;
  const Scene& scene_;
  const Shadow& shadow_;
  std::vector<TraceRow>* trace_;
  Aircraft plant_{scene_.vehicle, scene_.truth, scene_.curve.thrust_coefficient(), shadow_};
  Pilot pilot_ = pilot_for(scene_);
  Estimator estimator_{scene_.noise, kStep* kStepsPerTick, Random(scene_.seed)};
  ArmMotion motion_{scene_.vehicle.angles(experiment_.legs[0].shape), scene_.vehicle.build.morph_s};
  Configuration now_ = plant_.configuration(motion_.angles(0), {});
  AircraftState state_{};
  Reference reference_{};
  BodyMotion estimate_{};
  long step_ = 0;
  std::size_t leg_ = 0;

  FlightResult run() {
    const Reference start = reference_at(experiment_.path, 0);
    const double hover = kGravity * scene_.vehicle.build.mass_kg / 4 / scene_.curve.thrust_coefficient().value();
    state_ = level_state({start.position, start.velocity}, now_.mass, std::sqrt(hover));
    pilot_.set_arms(motion_.angles(0));
    FlightResult result;
    result.leg_count = experiment_.leg_count;
    for (leg_ = 0; leg_ < experiment_.leg_count && !result.lost; ++leg_) {
      result.lost = !fly_leg(result.legs[leg_]);
      if (result.lost) result.lost_leg = leg_;
    }
    result.concessions = pilot_.concessions();
    return result;
  }

  static Pilot pilot_for(const Scene& scene) {
    const auto pilot = Pilot::build(scene.vehicle, scene.curve, scene.pilot);
    if (!pilot) throw std::invalid_argument("no controller can be built for this vehicle; check its sizes and spins");
    return *pilot;
  }

  [[nodiscard]] double seconds() const noexcept { return static_cast<double>(step_) * kStep; }

  bool fly_leg(LegResult& result) {
    const Leg& leg = experiment_.legs[leg_];
    const Angles& goal = scene_.vehicle.angles(leg.shape);
    if (leg_ > 0 && goal != motion_.angles(seconds())) motion_.begin(goal, seconds());
    pilot_.compensate(leg.compensated);
    const long begins = step_, ends = begins + std::lround(leg_seconds(experiment_.path) / kStep);
    const long counts_from = begins + std::lround(settle_seconds(experiment_.path) / kStep);
    LegSums sums;
    for (; step_ < ends; ++step_) {
      if (step_ % kStepsPerTick == 0) {
        tick();
        if (lost()) return false;
        if (step_ >= counts_from) sums.add(reference_, estimate_, state_);
      }
      advance();
    }
    result = sums.result();
    return true;
  }

  [[nodiscard]] bool lost() const noexcept {
    const bool near = (reference_.position - state_.position()).norm() < kLostMetres;
    const bool upright = state_.y[7] * state_.y[7] + state_.y[8] * state_.y[8] < 0.5;
    return !near || !upright;
  }

  void tick() {
    reference_ = reference_at(experiment_.path, seconds());
    const BodyMotion truth = body_motion(state_, now_.mass);
    estimate_ = estimator_.estimate(truth);
    pilot_.look(reference_, estimate_, state_.attitude());
    if (trace_ != nullptr) trace_->push_back(row(truth));
  }

  void advance() noexcept {
    pilot_.set_arms(motion_.angles(seconds()));
    const Eigen::Vector4d speeds = pilot_.act(body_rates(state_, now_.mass));
    if (!motion_.moving(seconds())) {
      state_ = plant_.step(state_, kStep, {&now_, &now_, &now_}, speeds);
      return;
    }
    const Configuration middle = configuration_at(seconds() + kStep / 2), end = configuration_at(seconds() + kStep);
    state_ = plant_.step(state_, kStep, {&now_, &middle, &end}, speeds);
    now_ = end;
  }

  [[nodiscard]] Configuration configuration_at(double time) const noexcept {
    return plant_.configuration(motion_.angles(time), motion_.rates(time));
  }

  [[nodiscard]] TraceRow row(const BodyMotion& truth) const noexcept {
    TraceRow found;
    found.time = seconds();
    found.leg = leg_;
    found.reference = reference_.position;
    found.estimate = estimate_.position;
    found.truth = truth.position;
    found.rotation = roll_pitch_yaw(state_.attitude());
    const Angles arms = motion_.angles(seconds());
    const auto& compensator = pilot_.compensator();
    for (std::size_t i = 0; i < 4; ++i) {
      found.arm_angles[i] = arms[i].value();
      found.occlusions[i] = compensator.occlusion_angles()[i].value();
      found.scaling[i] = compensator.scaling_factors()[i];
      found.thrusts[i] = pilot_.thrusts()[i].value();
      found.speeds[i] = state_.rotors()[static_cast<Eigen::Index>(i)];
    }
    return found;
  }
};

}  // namespace

FlightResult fly(const Experiment& experiment, const Scene& scene, const Shadow& shadow, std::vector<TraceRow>* trace) {
  return Flight{experiment, scene, shadow, trace}.run();
}

}  // namespace kphi::flight
