// Any bytes as lines, airframe, arm angles, thrusts, layout and demands: whatever is built must fly without NaN, within
// its limits; φ in [0, 2π], k_i in its range, the plain map when off.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "compensation/compensator.hpp"
#include "compensation/kphi_compensation.h"
#include "compensation/mixing.hpp"

namespace {

using namespace kphi;
using namespace kphi::compensation;

void require(bool holds) {
  if (!holds) std::abort();
}

/// Reads numbers, plain ones and any bits, until there are no more; zeros then.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  std::uint8_t byte() { return at_ < size_ ? data_[at_++] : 0; }
  bool more() const { return at_ < size_; }
  /// One byte says how: any bits of a double, or a number of the given size.
  double number(double usual) {
    const std::uint8_t how = byte();
    if (how % 8 == 7) {
      std::uint64_t bits = 0;
      for (int i = 0; i < 8; ++i) bits = bits << 8 | byte();
      double value;
      std::memcpy(&value, &bits, sizeof value);
      return value;
    }
    return usual * (static_cast<double>(byte() << 8 | byte()) / 32768.0 - (how % 8 < 4 ? 0.0 : 1.0));
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_ = 0;
};

OverlapMeasure measure(Bytes& bytes) { return static_cast<OverlapMeasure>(bytes.byte() % 3); }

std::optional<OcclusionTable> table(Bytes& bytes, double scale) {
  Knot knots[kMostKnots + 1];
  const std::size_t count = bytes.byte() % (kMostKnots + 2);
  double phi = 0, value = scale;
  for (std::size_t i = 0; i < count; ++i) {
    knots[i] = {Radians(phi), value, bytes.byte() % 2 == 0 ? 0.01 * scale : bytes.number(scale)};
    phi = bytes.byte() % 8 == 0 ? bytes.number(7) : phi + 0.3;
    value = bytes.byte() % 8 == 0 ? bytes.number(scale) : 0.9 * value;
  }
  return OcclusionTable::from(knots, count);
}

std::optional<ThrustCurve> line(Bytes& bytes, OverlapMeasure overlap) {
  std::optional<LineUncertainty> uncertainty;
  if (bytes.byte() % 2 == 0) {
    uncertainty = LineUncertainty{bytes.number(1e-8), bytes.number(1e-16), bytes.number(1e-16), bytes.number(1e-16)};
  }
  return ThrustCurve::from_line(ThrustCoefficient(bytes.number(1e-6)), ThrustCoefficient(bytes.number(1e-6)),
                                bytes.number(1e-6), Radians(bytes.number(5)), overlap, uncertainty);
}

std::optional<ThrustCurve> curve_of(Bytes& bytes, OverlapMeasure overlap) {
  const std::uint8_t kind = bytes.byte();
  auto curve = line(bytes, overlap);
  if (kind % 2 == 0) {
    const auto k = table(bytes, 1e-6);
    curve = k ? ThrustCurve::from_table(*k, Radians(bytes.number(5)), overlap) : std::nullopt;
  }
  if (!curve) return curve;
  if (kind / 2 % 2 == 0) (void)curve->set_speed_trend({bytes.number(1e-4), RadPerSec(bytes.number(2000))});
  if (const auto share = kind / 4 % 2 == 0 ? table(bytes, 1) : std::nullopt) (void)curve->set_torque_share(*share);
  return curve;
}

Airframe airframe(Bytes& bytes, OverlapMeasure overlap) {
  Airframe frame{Metres(bytes.number(0.1)), Metres(bytes.number(0.2)), Metres(bytes.number(0.1)),
                 RadPerSec(bytes.number(100)), RadPerSec(bytes.number(2000))};
  frame.overlap = overlap;
  const std::uint8_t kind = bytes.byte();
  for (std::size_t i = 0; i < 4; ++i) frame.mirrored[i] = (kind >> i & 1) != 0;
  if (kind % 2 == 0) return frame;
  Position corners[ConvexPolygon::kMaxCorners];
  const std::size_t count = bytes.byte() % (ConvexPolygon::kMaxCorners + 1);
  double direction = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    if (kind % 4 == 1) {
      corners[i] = {Metres(bytes.number(0.2)), Metres(bytes.number(0.2))};
      continue;
    }
    direction += 0.01 + bytes.byte() / 128.0;  // on a circle: convex unless it goes round twice
    corners[i] = {Metres(0.1 * std::cos(direction)), Metres(0.1 * std::sin(direction))};
  }
  if (const auto outline = ConvexPolygon::from(corners, count)) {
    frame.polygon = PolygonBody{*outline, Rotors<Hinge>(bytes.byte() % 9)};
    for (Hinge& hinge : frame.polygon->hinges) {
      hinge = {{Metres(bytes.number(0.2)), Metres(bytes.number(0.2))}, Radians(bytes.number(7)), kind % 3 == 0};
    }
  }
  return frame;
}

void fly(Compensator& compensator, const Rotors<ThrustCurve>& curves, const Airframe& frame, ScalingLaw law,
         Bytes& bytes) {
  Rotors<Radians> arms(compensator.rotors());
  Rotors<Newtons> thrusts(compensator.rotors());
  for (Radians& arm : arms) arm = Radians(bytes.number(4));
  for (Newtons& thrust : thrusts) thrust = Newtons(bytes.number(8));
  compensator.enable(bytes.byte() % 4 != 0);
  compensator.set_arms(arms);
  const SpeedCommand command = compensator.speeds_for(thrusts);
  const auto uncertainties = compensator.speed_uncertainties(curves, thrusts, Radians(bytes.number(0.1)));
  for (std::size_t i = 0; i < compensator.rotors(); ++i) {
    const double phi = compensator.occlusion_angles()[i].value(), k = compensator.scaling_factors()[i];
    require(phi >= 0.0 && phi <= 2 * kPi);
    require(k <= 1.0 && (law == ScalingLaw::published || k >= kScalingFloor));
    require(command.speeds[i] >= frame.slowest_speed && command.speeds[i] <= frame.fastest_speed);
    require(compensator.thrust_max()[i].value() >= 0.0);
    require(compensator.drag_scale()[i] >= 1 / kMostTorque &&
            compensator.drag_scale()[i] <= kMostTorque / kScalingFloor);
    require(uncertainties[i].value() >= 0.0);
    require(compensator.enabled() || k == 1.0);
  }
}

void mix(const Compensator* compensator, Bytes& bytes) {
  const std::size_t count = compensator != nullptr ? compensator->rotors() : 3 + bytes.byte() % 6;
  RotorLayout layout{Rotors<HubPosition>(count), Rotors<int>(count)};
  for (std::size_t i = 0; i < count; ++i) layout.spins[i] = i % 2 == 0 ? 1 : -1;
  for (HubPosition& hub : layout.hubs) hub = {Metres(bytes.number(0.2)), Metres(bytes.number(0.2))};
  auto mixer = Mixer::build(layout, {Metres(bytes.number(0.02)), bytes.number(0.001)});
  if (!mixer) return;
  ThrustLimits limits{Rotors<Newtons>(count), Rotors<Newtons>(count)};
  for (std::size_t i = 0; i < count; ++i) {
    limits.smallest[i] = Newtons(bytes.number(1));
    limits.largest[i] = Newtons(bytes.number(8));
  }
  if (compensator != nullptr) {
    limits.largest = compensator->thrust_max();
    (void)mixer->set_layout(layout, compensator->drag_scale());
  }
  const Wrench demand{Newtons(bytes.number(20)), NewtonMetres(bytes.number(1)), NewtonMetres(bytes.number(1)),
                      NewtonMetres(bytes.number(0.2))};
  const MixedThrusts mixed = mixer->mix(demand, limits, NewtonMetres(bytes.number(0.05)));
  for (const Newtons thrust : mixed.thrusts) require(thrust.value() >= 0.0 && thrust.value() <= 1e9);
  require(std::isfinite(mixed.achieved.thrust.value()) && std::isfinite(mixed.achieved.roll.value()));
  require(std::isfinite(mixed.achieved.pitch.value()) && std::isfinite(mixed.achieved.yaw.value()));
}

/// The plain interface, with codes and counts that may be any.
void fly_in_c(Bytes& bytes) {
  kphi_curve line{};
  line.thrust_coefficient = bytes.number(1e-6);
  line.intercept = bytes.number(1e-6);
  line.slope_per_rad = bytes.number(1e-6);
  line.largest_fitted_rad = bytes.number(5);
  line.overlap = static_cast<signed char>(bytes.byte());
  line.has_uncertainty = bytes.byte() % 2;
  line.thrust_coefficient_error = bytes.number(1e-8);
  line.intercept_variance = bytes.number(1e-16);
  line.knot_count = bytes.byte() % 3 == 0 ? static_cast<signed char>(bytes.byte()) : 0;
  for (kphi_knot& knot : line.knots) knot = {bytes.number(5), bytes.number(1e-6), bytes.number(1e-8)};
  line.torque_count = bytes.byte() % 3 == 0 ? static_cast<signed char>(bytes.byte()) : 0;
  for (kphi_knot& knot : line.torque) knot = {bytes.number(5), bytes.number(1), bytes.number(1)};
  line.trend_per_rad_s = bytes.byte() % 2 == 0 ? bytes.number(1e-4) : 0;
  line.trend_reference = bytes.number(2000);
  kphi_airframe airframe{};
  airframe.half_side = bytes.number(0.1);
  airframe.arm_length = bytes.number(0.2);
  airframe.propeller_radius = bytes.number(0.1);
  airframe.fastest_speed = bytes.number(2000);
  airframe.overlap = line.overlap;
  airframe.corner_count = bytes.byte() % 3 == 0 ? static_cast<signed char>(bytes.byte()) : 0;
  for (auto& corner : airframe.corners) corner[0] = bytes.number(0.2), corner[1] = bytes.number(0.2);
  for (int i = 0; i < 4; ++i) airframe.hinge_turns[i] = i;
  if (bytes.byte() % 4 == 0) airframe.hinge_turns[bytes.byte() % 4] = static_cast<signed char>(bytes.byte());
  airframe.rotors = bytes.byte() % 2 == 0 ? 0 : static_cast<signed char>(bytes.byte());
  kphi_curve lines[KPHI_MAX_ROTORS];
  for (kphi_curve& one : lines) one = line;
  kphi_compensator compensator;
  const int refusal =
      kphi_compensator_build(&compensator, lines, &airframe, static_cast<signed char>(bytes.byte()) % 3);
  require(std::strlen(kphi_refusal_text(refusal)) > 0);
  if (refusal != 0) return;
  double arms[KPHI_MAX_ROTORS], thrusts[KPHI_MAX_ROTORS], speeds[KPHI_MAX_ROTORS] = {}, uncertainties[KPHI_MAX_ROTORS];
  unsigned short flags[KPHI_MAX_ROTORS];
  for (int i = 0; i < KPHI_MAX_ROTORS; ++i) arms[i] = bytes.number(4), thrusts[i] = bytes.number(8);
  kphi_set_arms(&compensator, arms);
  kphi_speeds_for(&compensator, thrusts, speeds, bytes.byte() % 2 == 0 ? flags : nullptr);
  kphi_speed_uncertainties(&compensator, lines, thrusts, bytes.number(0.1), uncertainties);
  for (int i = 0; i < 4; ++i) require(speeds[i] >= 0 && speeds[i] <= airframe.fastest_speed && uncertainties[i] >= 0);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, size);
  const OverlapMeasure overlap = measure(bytes);
  const auto law = static_cast<ScalingLaw>(bytes.byte() % 2);
  const auto some = curve_of(bytes, overlap), other = curve_of(bytes, overlap);
  const Airframe frame = airframe(bytes, overlap);
  std::optional<Compensator> compensator;
  std::optional<Rotors<ThrustCurve>> curves;
  if (some && other) {
    curves.emplace(rotors_of(frame), *some);
    for (std::size_t i = 1; i < curves->size(); i += 2) (*curves)[i] = *other;
    compensator = Compensator::build(*curves, frame, law).compensator;
  }
  for (int i = 0; i < 50 && bytes.more(); ++i) {
    if (compensator) fly(*compensator, *curves, frame, law, bytes);
    mix(compensator ? &*compensator : nullptr, bytes);
    fly_in_c(bytes);
  }
  return 0;
}
