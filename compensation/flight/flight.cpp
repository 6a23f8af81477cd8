#include "compensation/flight/flight.hpp"

#include <algorithm>
#include <stdexcept>

#include "compensation/flight/simulated_vehicle.hpp"

namespace kphi::flight {
namespace {

constexpr double kLostMetres = 1.0;
constexpr std::uint64_t kMotorStream = 101;  // random numbers of the motors; the nine flights use other streams
static_assert(kLongestGyroDelay / kStep < 31);

/// Sums over the part of a leg that counts.
class LegSums {
 public:
  explicit LegSums(std::size_t rotors) noexcept : rotors_(static_cast<double>(rotors)) {}
  void add(const Reference& reference, const BodyMotion& estimate, const AircraftState& state) noexcept {
    const Eigen::Vector3d error = reference.position - estimate.position;
    const double distance = error.norm();
    const auto rotors = state.rotors();
    ++count_;
    sums_.mean_error += error;
    sums_.mean_error_rate += reference.velocity - estimate.velocity;
    sums_.mean_distance += distance;
    square_distance_ += distance * distance;
    sums_.mean_square_speed += rotors.squaredNorm() / rotors_;
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
  double rotors_, count_ = 0, square_distance_ = 0;
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
  Aircraft plant_{scene_.vehicle, scene_.truth, shadow_};
  Pilot pilot_ = pilot_for(scene_);
  Estimator estimator_{scene_.noise, kStep* kStepsPerTick, Random(scene_.seed)};
  Arms arms_{scene_.vehicle.angles(experiment_.legs[0].shape), scene_.vehicle.build.morph_s, scene_.truth.arms, kStep};
  Configuration now_ = plant_.configuration(arms_.hubs(), {});
  AircraftState state_{};
  Reference reference_{};
  BodyMotion estimate_{};
  Angles told_ = arms_.hubs();                ///< what the controller was told of the arms
  RotorSpeeds speeds_ = RotorSpeeds::Zero();  ///< what it asked for [rad/s]
  std::array<BodyMotion, 32> estimates_{};    ///< a ring, for the delay
  std::array<Eigen::Vector3d, 32> rates_{};   ///< a ring, for the delay of the gyro
  Random motors_{scene_.seed, kMotorStream};
  RotorSpeeds deviation_ = RotorSpeeds::Zero();  ///< of the rotors' speeds, as a share
  long step_ = 0;
  std::size_t leg_ = 0;

  FlightResult run() {
    const Reference start = reference_at(experiment_.path, 0);
    const double hover = kGravity * scene_.vehicle.build.mass_kg / static_cast<double>(rotors()) /
                         scene_.truth.thrust_coefficient.value();
    state_ = level_state({start.position, start.velocity}, now_.mass, std::sqrt(hover));
    pilot_.set_arms(arms_.hubs());
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
    const auto pilot = Pilot::build(scene.vehicle, scene.curves, scene.pilot);
    if (!pilot)
      throw std::invalid_argument("no controller can be built for this vehicle; check its sizes, shapes and spins");
    return *pilot;
  }

  [[nodiscard]] std::size_t rotors() const noexcept { return scene_.vehicle.rotors(); }
  [[nodiscard]] double seconds() const noexcept { return static_cast<double>(step_) * kStep; }

  bool fly_leg(LegResult& result) {
    const Leg& leg = experiment_.legs[leg_];
    const Angles& goal = scene_.vehicle.angles(leg.shape);
    if (leg_ > 0 && goal != arms_.goal()) arms_.begin(goal);
    pilot_.compensate(leg.compensated);
    const long begins = step_, ends = begins + std::lround(leg_seconds(experiment_.path) / kStep);
    const long counts_from = begins + std::lround(settle_seconds(experiment_.path) / kStep);
    LegSums sums(rotors());
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
    const auto tick = static_cast<std::size_t>(step_ / kStepsPerTick);
    const auto late =
        std::min(static_cast<std::size_t>(std::lround(scene_.truth.estimate_delay_s / (kStep * kStepsPerTick))),
                 std::min(tick, estimates_.size() - 1));
    estimates_[tick % estimates_.size()] = estimator_.estimate(truth);
    estimate_ = estimates_[(tick - late) % estimates_.size()];
    pilot_.look(reference_, estimate_, state_.attitude());
    if (trace_ != nullptr) trace_->push_back(row(truth));
  }

  /// As old as the gyro is.
  [[nodiscard]] Eigen::Vector3d rates_told() noexcept {
    const auto step = static_cast<std::size_t>(step_);
    const auto late = std::min(static_cast<std::size_t>(std::lround(scene_.truth.gyro_delay_s / kStep)),
                               std::min(step, rates_.size() - 1));
    rates_[step % rates_.size()] = body_rates(state_, now_.mass);
    return rates_[(step - late) % rates_.size()];
  }
  /// What the motors make of what they are told: a deviation that wanders.
  [[nodiscard]] RotorSpeeds as_driven(const RotorSpeeds& told) noexcept {
    if (!(scene_.truth.motor_noise > 0)) return told;
    const double keep = std::exp(-kStep / kMotorNoiseMemory), fresh = std::sqrt(1 - keep * keep);
    for (double& one : deviation_.head(static_cast<Eigen::Index>(rotors())))
      one = keep * one + motors_.normal(0, fresh * scene_.truth.motor_noise);
    return told.cwiseProduct(RotorSpeeds::Ones() + deviation_).cwiseMax(0);
  }

  void advance() noexcept {
    const Angles told = arms_.tell();
    for (std::size_t i = 0; i < told.size(); ++i) told_[i] = told[scene_.truth.wiring[i]];
    pilot_.set_arms(told_);
    speeds_ = as_driven(pilot_.act(rates_told()));
    if (!arms_.moving()) {
      arms_.advance(seconds() + kStep);
      state_ = plant_.step(state_, kStep, {&now_, &now_, &now_}, speeds_);
      return;
    }
    const Configuration middle = configuration_at(seconds() + kStep / 2), end = configuration_at(seconds() + kStep);
    state_ = plant_.step(state_, kStep, {&now_, &middle, &end}, speeds_);
    now_ = end;
  }

  [[nodiscard]] Configuration configuration_at(double time) noexcept {
    arms_.advance(time);
    return plant_.configuration(arms_.hubs(), arms_.rates());
  }

  [[nodiscard]] TraceRow row(const BodyMotion& truth) const noexcept {
    TraceRow found;
    found.time = seconds();
    found.leg = leg_;
    found.on_ways = scene_.vehicle.ways.size() != 0;
    found.reference = reference_.position;
    found.estimate = estimate_.position;
    found.truth = truth.position;
    found.rotation = roll_pitch_yaw(state_.attitude());
    const Angles& arms = arms_.hubs();
    const auto& compensator = pilot_.compensator();
    for (auto* each : {&found.arms, &found.arms_told, &found.occlusions, &found.occlusions_believed, &found.scaling,
                       &found.thrusts_asked, &found.thrusts, &found.speeds_asked, &found.speeds})
      each->resize(rotors());
    for (std::size_t i = 0; i < rotors(); ++i) {
      const auto rotor = static_cast<Eigen::Index>(i);
      found.arms[i] = arms[i].value() + scene_.truth.arm_error[i];
      found.arms_told[i] = told_[i].value();
      found.occlusions[i] = shadow_.arc(i, Radians(found.arms[i]));
      found.occlusions_believed[i] = compensator.occlusion_angles()[i].value();
      found.scaling[i] = compensator.scaling_factors()[i];
      found.thrusts_asked[i] = i < pilot_.thrusts().size() ? pilot_.thrusts()[i].value() : 0.0;
      found.speeds_asked[i] = speeds_[rotor];
      found.speeds[i] = state_.rotors()[rotor];
      found.thrusts[i] = now_.thrust_per_square[i] * found.speeds[i] * found.speeds[i];
    }
    return found;
  }
};

}  // namespace

FlightResult fly(const Experiment& experiment, const Scene& scene, const Shadow& shadow, std::vector<TraceRow>* trace) {
  return Flight{experiment, scene, shadow, trace}.run();
}

}  // namespace kphi::flight
