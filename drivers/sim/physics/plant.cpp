#include "drivers/sim/physics/plant.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::sim {
namespace {

constexpr int kTicksPerDrift = 70;  // every 10 ms
constexpr double kDriftInterval = kTicksPerDrift * kTick;
// Mountings draw from a sequence of their own, so that the noise stays the same with and without their scatter.
constexpr std::uint64_t kMountingStream = 0x94d049bb'133111ebull;

}  // namespace

LoadCell::LoadCell(const LoadCellParameters& parameters, Random& random) noexcept : parameters_(parameters) {
  for (std::size_t axis = 0; axis < zero_.size(); ++axis)
    zero_[axis] = parameters.zero_spread[axis] * random.symmetric();
}

void LoadCell::load(const AirLoad& air) noexcept {
  air_ = air;
  const double half = 2 * std::min(air.occluded_share, 1 - air.occluded_share);
  blade_amplitude_ = parameters_.blade_pass + parameters_.blade_pass_occluded * half;
}

void LoadCell::step(double speed, double reaction_torque, Random& random) noexcept {
  rotate(speed);
  const double square = speed * std::abs(speed);
  const double k = air_.thrust * (1 + air_.rise_per_krad_s * (std::abs(speed) / 1000 - 1));
  thrust_ += kTick / parameters_.thrust_lag * (k * square - thrust_);

  const double swing = air_.thrust_unoccluded * square;
  const double double_cosine = cosine_ * cosine_ - sine_ * sine_;
  const double double_sine = 2 * cosine_ * sine_;
  const bool three = air_.blades == 3;
  const double blade_cosine = three ? double_cosine * cosine_ - double_sine * sine_ : double_cosine;

  const double once = parameters_.once_per_turn * swing;
  const auto [weight_x, weight_y, weight_z] = weight();
  const double fz = weight_z + thrust_ + once * cosine_ + blade_amplitude_ * swing * blade_cosine;
  const double tz = reaction_torque * (1 + 0.02 * blade_cosine);
  // Cross-talk of the cell, and a thrust axis that misses the cell's centre by about a millimetre.
  const double fx = weight_x + once * cosine_ + 0.004 * fz;
  const double fy = weight_y + once * sine_ - 0.003 * fz;
  const Wrench load{fx, fy, fz + 0.002 * once * sine_, 0.0010 * fz, -0.0008 * fz, tz};

  if (++ticks_ % kTicksPerDrift == 0) drift(random);
  for (std::size_t axis = 0; axis < load.size(); ++axis) {
    reading_[axis] = parameters_.gain * load[axis] + zero_[axis] + parameters_.noise[axis] * random.normal();
  }
  reading_[2] += slow_noise_;
}

void LoadCell::hang(std::size_t axis, double newtons) noexcept {
  if (axis != weight_axis_) largest_weight_ = 0;
  weight_axis_ = axis;
  weight_ = newtons;
  if (std::abs(newtons) > std::abs(largest_weight_)) largest_weight_ = newtons;
}

/// Read on x, y and z: on the way back from its largest, a weight reads too much.
std::array<double, 3> LoadCell::weight() const noexcept {
  std::array<double, 3> read{};
  read[weight_axis_] = weight_ + parameters_.hysteresis * (largest_weight_ - weight_);
  return read;
}

void LoadCell::rotate(double speed) noexcept {
  const double turn = speed * kTick;  // below 0.5 rad at 3450 rad/s: the short series are good to 1e-8
  const double square = turn * turn;
  const double c = 1 - square / 2 * (1 - square / 12 * (1 - square / 30));
  const double s = turn * (1 - square / 6 * (1 - square / 20 * (1 - square / 42)));
  const double cosine = cosine_ * c - sine_ * s;
  const double sine = sine_ * c + cosine_ * s;
  const double shrink = 1.5 - 0.5 * (cosine * cosine + sine * sine);  // one Newton step back to length 1
  cosine_ = cosine * shrink;
  sine_ = sine * shrink;
}

void LoadCell::drift(Random& random) noexcept {
  constexpr double kMinutes = kDriftInterval / 60;
  constexpr double kRootMinutes = 0.012909944487358056;  // sqrt(0.01/60)
  for (std::size_t axis = 0; axis < zero_.size(); ++axis) {
    zero_[axis] += parameters_.drift_per_minute[axis] * kMinutes +
                   parameters_.walk_per_root_minute[axis] * kRootMinutes * random.normal();
  }
  if (parameters_.slow_noise == 0) return;
  const double kept = std::exp(-kDriftInterval / parameters_.slow_noise_seconds);
  slow_noise_ = kept * slow_noise_ + parameters_.slow_noise * std::sqrt(1 - kept * kept) * random.normal();
}

Plant::Plant(const PlantParameters& parameters, std::uint64_t seed)
    : density_share_(parameters.air_density_kg_m3 / 1.225),
      stand_(parameters.stand),
      random_(seed),
      mountings_(stand_.mounting_seed.value_or(seed) ^ kMountingStream),
      motor_(parameters.motor),
      load_cell_(parameters.load_cell, random_) {
  mount(nullptr, 0);
}

void Plant::mount(const PropellerTruth* propeller, double named_deg) {
  air_ = AirLoad{};
  shaft_ = ShaftLoad{};
  if (propeller != nullptr) {
    const double occlusion_deg = stand_.true_deg(named_deg);
    const double mounted = 1 + stand_.mounting * mountings_.normal();
    air_.thrust = stand_.spin * density_share_ * stand_.k(*propeller, occlusion_deg) * mounted;
    air_.thrust_unoccluded = stand_.spin * density_share_ * stand_.k(*propeller, 0);
    air_.rise_per_krad_s = stand_.rise_per_krad_s;
    air_.blades = propeller->blades;
    air_.occluded_share = occlusion_deg / 360;
    shaft_.drag = density_share_ * sim::torque_coefficient(*propeller, occlusion_deg);
    shaft_.inertia = propeller->inertia_kg_m2;
  }
  load_cell_.load(air_);
  motor_.load(shaft_);
}

void Plant::step(const PowerStage& stage) noexcept {
  motor_.step(stage, random_);
  load_cell_.step(motor_.state().speed, motor_.reaction_torque(), random_);
}

}  // namespace kphi::sim
