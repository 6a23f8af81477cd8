#include <float.h>
#include <math.h>
#include <stdio.h>

#include "px4_morphing_rotors.hpp"

namespace {

constexpr float kPerDegree = 0.01745329252f;
constexpr int kNameSize = 17;  // 16 characters, as MAVLink has them

/// Reads one after the other and keeps the name of the first that is missing.
class Reader {
 public:
  explicit Reader(ParameterReader parameter) : _parameter(parameter) {}

  float number(const char* format, int index = 0) {
    snprintf(_name, sizeof _name, format, index);
    const float value = _parameter(_name);
    if (!(fabsf(value) <= FLT_MAX)) refuse();
    return value;
  }
  int whole(const char* format, int index = 0) { return static_cast<int>(lroundf(number(format, index))); }
  int count(const char* format, int most) {
    const int value = whole(format);
    if (value >= 0 && value <= most) return value;
    refuse();
    return 0;
  }
  float positive(const char* format, int index = 0) {
    const float value = number(format, index);
    if (!(value > 0.f)) refuse();
    return value;
  }
  /// Of what was read last.
  void refuse() {
    if (!_refused) snprintf(_refused_name, kNameSize, "%s", _name);
    _refused = true;
  }
  const char* refusal() const { return _refused ? _refused_name : nullptr; }

 private:
  static char _refused_name[kNameSize];
  ParameterReader _parameter;
  char _name[kNameSize];
  bool _refused{false};
};
char Reader::_refused_name[kNameSize];

int read_knots(Reader& from, const char* count, const char* phi, const char* value, float scale, kphi_knot* knots) {
  const int found = from.count(count, KPHI_MAX_KNOTS);
  for (int i = 0; i < found; ++i)
    knots[i] = {from.number(phi, i) * kPerDegree, scale * from.number(value, i), HUGE_VALF};
  return found;
}

/// Everything of k is told as a share of K_T, which is the thrust at full output over the square of that speed.
kphi_curve read_curve(Reader& from, float k_t) {
  kphi_curve curve{};
  curve.thrust_coefficient = k_t;
  curve.intercept = k_t * from.number("KPHI_LINE_K");
  curve.slope_per_rad = k_t * from.number("KPHI_LINE_S") / kPerDegree;
  curve.largest_fitted_rad = from.positive("KPHI_PHI_MAX") * kPerDegree;
  curve.overlap = from.count("KPHI_OVERLAP", KPHI_LOAD_SHARE);
  curve.knot_count = read_knots(from, "KPHI_K_N", "KPHI_K_PHI%d", "KPHI_K%d", k_t, curve.knots);
  curve.torque_count = read_knots(from, "KPHI_TQ_N", "KPHI_TQ_PHI%d", "KPHI_TQ%d", 1.f, curve.torque);
  curve.trend_per_rad_s = from.number("KPHI_TREND");
  curve.trend_reference = from.number("KPHI_TREND_W");
  return curve;
}

kphi_airframe read_airframe(Reader& from, int rotors) {
  kphi_airframe airframe{};
  airframe.rotors = rotors;
  airframe.arm_length = from.positive("KPHI_ARM");
  airframe.propeller_radius = from.positive("KPHI_PROP_R");
  airframe.fastest_speed = from.positive("KPHI_W_MAX");
  airframe.half_side = from.number("KPHI_HALF_SIDE");
  airframe.has_arm_limits = 1;
  airframe.arm_from_rad = from.number("KPHI_ARM_MIN") * kPerDegree;
  airframe.arm_to_rad = from.number("KPHI_ARM_MAX") * kPerDegree;
  airframe.arm_stale_rad = from.number("KPHI_ARM_STALE") * kPerDegree;
  airframe.corner_count = from.count("KPHI_C_N", KPHI_MAX_CORNERS);
  for (int i = 0; i < airframe.corner_count; ++i) {
    airframe.corners[i][0] = from.number("KPHI_C%d_X", i);
    airframe.corners[i][1] = from.number("KPHI_C%d_Y", i);
  }
  for (int i = 0; i < rotors; ++i) {
    const float turn = from.number("KPHI_H%d_TURN", i);
    airframe.mirrored[i] = from.whole("KPHI_H%d_MIRR", i);
    airframe.hinge_turn_rad[i] = turn * kPerDegree;
    if (i < 4) airframe.hinge_turns[i] = static_cast<int>(lroundf(turn / 90.f));
    if (airframe.corner_count == 0) continue;
    airframe.hinges[i][0] = from.number("KPHI_H%d_X", i);
    airframe.hinges[i][1] = from.number("KPHI_H%d_Y", i);
  }
  return airframe;
}

}  // namespace

const char* read_morphing_vehicle(ParameterReader parameter, MorphingVehicle& vehicle) {
  Reader from(parameter);
  const int rotors = from.count("CA_ROTOR_COUNT", KPHI_MAX_ROTORS);
  vehicle.airframe = read_airframe(from, rotors);
  vehicle.full_thrust = from.positive("CA_ROTOR%d_CT", 0);
  const float fastest = vehicle.airframe.fastest_speed;
  vehicle.curves[0] = read_curve(from, vehicle.full_thrust / (fastest * fastest));
  vehicle.airframe.overlap = vehicle.curves[0].overlap;
  vehicle.masses = {};
  vehicle.masses.body = from.positive("KPHI_M_BODY");
  vehicle.masses.body_at[0] = from.number("KPHI_M_X");
  vehicle.masses.body_at[1] = from.number("KPHI_M_Y");
  for (int i = 0; i < rotors; ++i) {
    vehicle.curves[i] = vehicle.curves[0];
    vehicle.masses.at_hubs[i] = from.number("KPHI_M_HUB");
    vehicle.reference[i] = from.number("KPHI_REF%d", i) * kPerDegree;
    // One propeller for all.
    if (fabsf(from.number("CA_ROTOR%d_CT", i) - vehicle.full_thrust) > 1e-5f * vehicle.full_thrust) from.refuse();
    // PX4: positive for a rotor that turns counter-clockwise; its drag torque points down.
    const float km = from.number("CA_ROTOR%d_KM", i);
    vehicle.spins[i] = km > 0.f ? -1 : 1;
    vehicle.drag_per_newton = fabsf(km);
    if (!(vehicle.drag_per_newton > 0.f)) from.refuse();
  }
  return from.refusal();
}
