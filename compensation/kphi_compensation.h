// The library that flies, for C and for stacks that speak double[4]: the classes Compensator and Mixer of
// compensator.hpp and mixing.hpp, number for number. Angles [rad], lengths [m], thrusts [N], torques [N m], speeds
// [rad/s], coefficients [N/(rad/s)^2]; rotors in the order 0..3 (the paper's 1..4). Links with a C compiler: needs only
// the mathematics library.
//
// Real-time: no call allocates, locks, or loops without a bound. Not synchronised: call from one thread, or copy the
// structs (plain bytes). A pointer must not be null; a kphi_compensator or kphi_mixer must come from its build, which
// returned 0 or 1.
#ifndef KPHI_COMPENSATION_H
#define KPHI_COMPENSATION_H

#ifdef __cplusplus
extern "C" {
#endif

// How the overlap of disk and body becomes one angle phi (overlap_measure.hpp).
enum { KPHI_RIM_ARC = 0, KPHI_AREA_SHARE = 1, KPHI_LOAD_SHARE = 2 };
// How k(phi) becomes k_i (thrust_curve.hpp): held in [0.1, 1], or equation 4 of the paper to the letter.
enum { KPHI_LAW_CLAMPED = 0, KPHI_LAW_PUBLISHED = 1 };
// Flags of one rotor (compensator.hpp).
enum {
  KPHI_THRUST_NAN = 1,
  KPHI_THRUST_NEGATIVE = 2,
  KPHI_SPEED_AT_SLOWEST = 4,
  KPHI_SPEED_AT_FASTEST = 8,
  KPHI_ARM_ANGLE_UNKNOWN = 16,
  KPHI_BEYOND_FIT = 32,
  KPHI_AT_FLOOR = 64,
  KPHI_AT_CEILING = 128
};
// What the mixer gave up (mixing.hpp).
enum { KPHI_GAVE_YAW = 1, KPHI_GAVE_THRUST = 2, KPHI_GAVE_ROLL_PITCH = 4, KPHI_DEMAND_NAN = 8 };

enum { KPHI_MAX_CORNERS = 12 };

// k(phi) = intercept + slope phi of one propeller, K_T measured without occlusion. Zero-initialise, then fill in.
typedef struct kphi_line {
  double thrust_coefficient;  // K_T, > 0
  double intercept;           // > 0
  double slope_per_rad;
  double largest_fitted_rad;  // in (0, 2 pi]
  int overlap;                // KPHI_RIM_ARC ..: the measure of the fit
  int has_uncertainty;        // 0: the next four do not count
  double thrust_coefficient_error;
  double intercept_variance;
  double covariance;
  double slope_variance;
} kphi_line;

// Zero-initialise, then fill in. corner_count 0: the square |x|, |y| <= half_side, arm i hinged at the corner
// (half_side, half_side) turned by hinge_turns[i] times 90 degrees. Else a convex body, corners counter-clockwise, hub
// i at hinges[i] + arm_length (cos b, sin b), b = turn + theta (turn - theta if mirrored).
typedef struct kphi_airframe {
  double half_side;
  double arm_length;        // > propeller_radius
  double propeller_radius;  // > 0
  double slowest_speed;     // >= 0
  double fastest_speed;
  int hinge_turns[4];  // 0, 1, 2, 3 in any order
  int mirrored[4];
  int overlap;  // KPHI_RIM_ARC ..: the measure of the flight; must be that of every line
  int corner_count;
  double corners[KPHI_MAX_CORNERS][2];
  double hinges[4][2];
  double hinge_turn_rad[4];
} kphi_airframe;

// Opaque; plain bytes, with room for another form of k(phi) than a line.
typedef struct kphi_compensator {
  double state[512];
} kphi_compensator;

// 0, or why not: kphi_refusal_text() says it in words. Nothing is built then.
int kphi_compensator_build(kphi_compensator* out, const kphi_line lines[4], const kphi_airframe* airframe, int law);
const char* kphi_refusal_text(int refusal);

// At servo rate: phi [rad, 0 .. 2 pi] and k_i of the arms that moved. An angle that is not finite keeps the last phi
// and raises KPHI_ARM_ANGLE_UNKNOWN.
void kphi_set_arms(kphi_compensator* compensator, const double arm_angles_rad[4]);
// At control rate: sqrt(max(T, 0)/(K_T k_i)) (equation 4), held within the speed limits. NaN counts as no thrust.
// `flags`, the sum of the flags above per rotor, may be null.
void kphi_speeds_for(const kphi_compensator* compensator, const double thrusts_n[4], double speeds_rad_s[4],
                     unsigned char flags[4]);
// Compensated or not; off is the plain map sqrt(T/K_T) bit for bit.
void kphi_enable(kphi_compensator* compensator, int on);

// phi of each rotor [rad, 0 .. 2 pi], and k_i: [0.1, 1], or what equation 4 gives.
void kphi_occlusion_angles(const kphi_compensator* compensator, double angles_rad[4]);
void kphi_scaling_factors(const kphi_compensator* compensator, double factors[4]);
// K_T k_i fastest_speed^2, for the mixer's limits.
void kphi_thrust_max(const kphi_compensator* compensator, double thrusts_n[4]);
// 1/k_i: torque per thrust grows by this, for the mixer.
void kphi_drag_scale(const kphi_compensator* compensator, double scales[4]);
// Standard uncertainty of the speeds; HUGE_VAL where none can be given. Not for the control loop.
void kphi_speed_uncertainties(const kphi_compensator* compensator, const double thrusts_n[4],
                              double arm_angle_uncertainty_rad, double uncertainties_rad_s[4]);

// Opaque; plain bytes.
typedef struct kphi_mixer {
  double state[48];
} kphi_mixer;

// 1 if the layout can be flown. Hubs [x, y] relative to the centre of gravity, x forward, y left; spins +1 or -1, +1
// where the drag torque points along +z (up); drag torque of a rotor = f0 (per_newton + per_square_newton f0), f0 = K_T
// omega^2.
int kphi_mixer_build(kphi_mixer* out, const double hubs[4][2], const int spins[4], double drag_per_newton,
                     double drag_per_square_newton);
// At servo rate; drag_scale of kphi_drag_scale, each > 0. 0, and the layout before is kept, if this one cannot be
// flown: a number is not finite, a spin neither +1 nor -1, or the rotors cannot make every torque.
int kphi_mixer_set_layout(kphi_mixer* mixer, const double hubs[4][2], const int spins[4], const double drag_scale[4]);
// At control rate: thrusts f = A^-1 wrench within the limits, wrench = [thrust N, roll, pitch, yaw N m], A's columns
// [1; y_i; -x_i; s_i kappa_i(f_i)]. What the limits do not allow is given up in the order yaw (no further than to
// assured_yaw), collective thrust, roll and pitch. Returns the sum of what was given up (KPHI_GAVE_..,
// KPHI_DEMAND_NAN), 0 if nothing. `achieved`, the wrench of these thrusts, may be null.
int kphi_mix(const kphi_mixer* mixer, const double wrench[4], const double smallest_n[4], const double largest_n[4],
             double assured_yaw, double thrusts_n[4], double achieved[4]);

#ifdef __cplusplus
}
#endif

#endif
