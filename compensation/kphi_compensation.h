// The library that flies, for C99, for C++ before C++17 and for stacks that speak arrays: the classes Compensator and
// Mixer of compensator.hpp and mixing.hpp, number for number. Angles [rad], lengths [m], thrusts [N], torques [N m],
// speeds [rad/s], coefficients [N/(rad/s)^2]; rotors in the order 0, 1, 2 .. (the paper's 1, 2, 3 ..). Links with a C
// compiler: needs only the mathematics library.
//
// Real-time: no call allocates, locks, or loops without a bound. Not synchronised: call from one thread, or copy the
// structs (plain bytes). A pointer must not be null; a kphi_compensator or kphi_mixer must come from its build, which
// returned 0 or 1.
#ifndef KPHI_COMPENSATION_H
#define KPHI_COMPENSATION_H

#define KPHI_COMPENSATION_VERSION_MAJOR 0
#define KPHI_COMPENSATION_VERSION_MINOR 2
#define KPHI_COMPENSATION_VERSION_PATCH 0
#define KPHI_COMPENSATION_VERSION "0.2.0"

// float where the library was built with KPHI_FLOAT. Who gets it wrong is told by the linker, which does not find a
// build function of that name.
#ifdef KPHI_FLOAT
typedef float kphi_real;
#define kphi_compensator_build kphi_compensator_build_float
#define kphi_mixer_build kphi_mixer_build_float
#define kphi_factor_build kphi_factor_build_float
#else
typedef double kphi_real;
#endif

#ifdef __cplusplus
extern "C" {
#endif

// KPHI_COMPENSATION_VERSION of the library that is linked.
const char* kphi_compensation_version(void);

// How the overlap of disk and body becomes one angle phi (convex_polygon.hpp).
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
  KPHI_AT_CEILING = 128,
  KPHI_ARM_ANGLE_BEYOND = 256,
  KPHI_ARM_ANGLE_STALE = 512
};
// What the mixer gave up (mixing.hpp).
enum {
  KPHI_GAVE_YAW = 1,
  KPHI_GAVE_THRUST = 2,
  KPHI_GAVE_ROLL_PITCH = 4,
  KPHI_DEMAND_NAN = 8,
  KPHI_MIX_UNFINISHED = 16
};
// What deserves a look before a curve is flown (compensator.hpp).
enum { KPHI_GAINS_WITH_OCCLUSION = 1, KPHI_STEPS_AT_CONTACT = 2 };

enum { KPHI_MAX_CORNERS = 12, KPHI_MAX_ROTORS = 8, KPHI_MAX_KNOTS = 12 };

// A value at one phi; between two of them straight.
typedef struct kphi_knot {
  kphi_real phi_rad;  // the first 0, ascending
  kphi_real value;
  kphi_real error;  // standard uncertainty; HUGE_VAL: unknown
} kphi_knot;

// What the bench knows of one propeller: k(phi) = intercept + slope phi with K_T measured without occlusion, or a
// table. Zero-initialise, then fill in.
typedef struct kphi_curve {
  kphi_real thrust_coefficient;  // K_T, > 0
  kphi_real intercept;           // > 0
  kphi_real slope_per_rad;
  kphi_real largest_fitted_rad;  // in (0, 2 pi]
  int overlap;                   // KPHI_RIM_ARC ..: the measure of the fit
  int has_uncertainty;           // 0: the next four do not count
  kphi_real thrust_coefficient_error;
  kphi_real intercept_variance;
  kphi_real covariance;
  kphi_real slope_variance;
  int knot_count;  // 0: the line; else 2 to 12, and largest_fitted_rad and overlap alone count of the above
  kphi_knot knots[KPHI_MAX_KNOTS];   // k, positive, not rising; the first is K_T
  int torque_count;                  // 0: the drag torque does not depend on phi
  kphi_knot torque[KPHI_MAX_KNOTS];  // drag torque as a share of that at phi 0, at one speed; in (0, 10)
  kphi_real trend_per_rad_s;         // k at w is k(phi) (1 + trend (w - reference)); 0: does not depend on it
  kphi_real trend_reference;         // > 0, times the trend at most 0.3
} kphi_curve;

// Zero-initialise, then fill in. corner_count 0: the square |x|, |y| <= half_side with four arms, arm i hinged at the
// corner (half_side, half_side) turned by hinge_turns[i] times 90 degrees. Else a convex body with 3 to 8 arms, corners
// counter-clockwise, hub i at hinges[i] + arm_length (cos b, sin b), b = turn + theta (turn - theta if mirrored).
typedef struct kphi_airframe {
  kphi_real half_side;
  kphi_real arm_length;        // > 0; on the square > every propeller radius
  kphi_real propeller_radius;  // > 0
  kphi_real slowest_speed;     // >= 0
  kphi_real fastest_speed;
  int rotors;          // 3 to 8; 0: 4
  int hinge_turns[4];  // 0, 1, 2, 3 in any order
  int mirrored[KPHI_MAX_ROTORS];
  int overlap;  // KPHI_RIM_ARC ..: the measure of the flight; must be that of every curve
  int corner_count;
  kphi_real corners[KPHI_MAX_CORNERS][2];
  kphi_real hinges[KPHI_MAX_ROTORS][2];
  kphi_real hinge_turn_rad[KPHI_MAX_ROTORS];
  int propellers_differ;  // 0: the next one does not count
  kphi_real propeller_radii[KPHI_MAX_ROTORS];
  int has_arm_limits;      // 0: -100 to 190 degrees and 2 degrees
  kphi_real arm_from_rad;  // an angle below it or above arm_to_rad is not believed
  kphi_real arm_to_rad;
  kphi_real arm_stale_rad;    // how far an arm may have moved since its angle was measured
  kphi_real arm_oldest_s;     // an angle older than this is stale whatever its rate; 0: 0.5 s
  kphi_real hub_stale_m;      // as arm_stale_rad, for kphi_set_hubs; 0: 0.004 m
  int more_corner_counts[2];  // of up to two further convex parts of the body, which must not overlap; 0: none
  kphi_real more_corners[2][KPHI_MAX_CORNERS][2];
} kphi_airframe;

// What moves the centre of gravity with the arms [kg, m]. An arm's beam counts half at its hub, half with the body.
typedef struct kphi_masses {
  kphi_real body;
  kphi_real body_at[2];
  kphi_real at_hubs[KPHI_MAX_ROTORS];
} kphi_masses;

// Opaque; plain bytes. Arrays in the calls below hold a number for each of its rotors.
typedef struct kphi_compensator {
  kphi_real state[512];
} kphi_compensator;

// 0, or why not: kphi_refusal_text() says it in words; `out` has no rotors then, and its calls do nothing. A curve for
// each rotor; the tables that differ may have 96 knots together.
int kphi_compensator_build(kphi_compensator* out, const kphi_curve* curves, const kphi_airframe* airframe, int law);
const char* kphi_refusal_text(int refusal);
// The sum of what speaks against flying the curve (KPHI_GAINS_WITH_OCCLUSION, KPHI_STEPS_AT_CONTACT); -1: it is none.
int kphi_curve_doubts(const kphi_curve* curve, int law);

// At servo rate: phi [rad, 0 .. 2 pi] and k_i of the arms that moved. An angle that is not finite, or outside the arm's
// limits, keeps the last phi and raises KPHI_ARM_ANGLE_UNKNOWN or KPHI_ARM_ANGLE_BEYOND.
void kphi_set_arms(kphi_compensator* compensator, const kphi_real* arm_angles_rad);
// The same of angles that were measured age_s ago on arms that moved at these rates [rad/s]; KPHI_ARM_ANGLE_STALE where
// one may have moved too far since.
void kphi_set_moving_arms(kphi_compensator* compensator, const kphi_real* arm_angles_rad, const kphi_real* rates,
                          kphi_real age_s);
// Instead of these two: hubs [x, y] in the body frame [m], measured age_s ago, moving at these speeds [m/s, may be
// null]. For arms that get longer, of several joints, or measured by where their hubs are.
void kphi_set_hubs(kphi_compensator* compensator, const kphi_real (*hubs)[2], const kphi_real* speeds, kphi_real age_s);
// At control rate: sqrt(max(T, 0)/(K_T k_i)) (equation 4), held within the speed limits. NaN counts as no thrust.
// `flags`, the sum of the flags above per rotor, may be null.
void kphi_speeds_for(const kphi_compensator* compensator, const kphi_real* thrusts_n, kphi_real* speeds_rad_s,
                     unsigned short* flags);
// Without a speed loop: T/k_i [N], what to ask of the thrust curve of an uncovered propeller.
void kphi_uncovered_thrusts(const kphi_compensator* compensator, const kphi_real* thrusts_n, kphi_real* uncovered_n);
// Throttle in [0, 1] of T = full_n (square_share u^2 + (1 - square_share) u); square_share is PX4's THR_MDL_FAC.
kphi_real kphi_throttle(kphi_real full_n, kphi_real square_share, kphi_real uncovered_n);
// Compensated or not; off is the plain map sqrt(T/K_T) bit for bit.
void kphi_enable(kphi_compensator* compensator, int on);

// The air's density now over that of the fit; 0, and the ratio before is kept, unless it is in (0.1, 10).
int kphi_set_air_density_ratio(kphi_compensator* compensator, kphi_real ratio);
// New coefficients in flight: `compensator`, just built, goes on from where `before` is; then copy it over `before`.
void kphi_resume_from(kphi_compensator* compensator, const kphi_compensator* before);

// phi of each rotor [rad, 0 .. 2 pi], and k_i: [0.1, 1], or what equation 4 gives.
void kphi_occlusion_angles(const kphi_compensator* compensator, kphi_real* angles_rad);
void kphi_scaling_factors(const kphi_compensator* compensator, kphi_real* factors);
// K_T k_i fastest_speed^2, for the mixer's limits.
void kphi_thrust_max(const kphi_compensator* compensator, kphi_real* thrusts_n);
// 1/k_i times the torque's share: torque per thrust grows by this, for the mixer.
void kphi_drag_scale(const kphi_compensator* compensator, kphi_real* scales);
// Hubs about the centre of gravity of the shape of the last arm angles, for the mixer; NaN before the first.
void kphi_hubs(const kphi_compensator* compensator, const kphi_masses* masses, kphi_real (*hubs)[2]);
// Standard uncertainty of the speeds, from that of the curves it was built of, which it does not keep; HUGE_VAL where
// none can be given. Not for the control loop.
void kphi_speed_uncertainties(const kphi_compensator* compensator, const kphi_curve* curves, const kphi_real* thrusts_n,
                              kphi_real arm_angle_uncertainty_rad, kphi_real* uncertainties_rad_s);

// Opaque; plain bytes.
typedef struct kphi_mixer {
  kphi_real state[96];
} kphi_mixer;

// 1 if the layout can be flown. 3 to 8 hubs [x, y] relative to the centre of gravity, x forward, y left; spins +1 or
// -1, +1 where the drag torque points along +z (up); drag torque of a rotor = f0 (per_newton + per_square_newton f0),
// f0 = K_T omega^2.
int kphi_mixer_build(kphi_mixer* out, int rotors, const kphi_real (*hubs)[2], const int* spins,
                     kphi_real drag_per_newton, kphi_real drag_per_square_newton);
// At servo rate; drag_scale of kphi_drag_scale, each > 0. 0, and the layout before is kept, if this one cannot be
// flown: a number is not finite, a spin neither +1 nor -1, or the rotors cannot make every torque.
int kphi_mixer_set_layout(kphi_mixer* mixer, const kphi_real (*hubs)[2], const int* spins, const kphi_real* drag_scale);
// At control rate: thrusts f = A^-1 wrench within the limits, wrench = [thrust N, roll, pitch, yaw N m], A's columns
// [1; y_i; -x_i; s_i kappa_i(f_i)]. What the limits do not allow is given up in the order yaw (down to assured_yaw),
// collective thrust, assured yaw, roll and pitch. Returns the sum of what was given up (KPHI_GAVE_.., KPHI_DEMAND_NAN,
// KPHI_MIX_UNFINISHED: the search ended early), 0 if nothing. `achieved`, the wrench of these thrusts, may be null.
int kphi_mix(const kphi_mixer* mixer, const kphi_real wrench[4], const kphi_real* smallest_n,
             const kphi_real* largest_n, kphi_real assured_yaw, kphi_real* thrusts_n, kphi_real achieved[4]);

// By which factor the thrust in flight differs from what the flown k tell (thrust_factor.hpp); it changes nothing.
// Opaque; plain bytes.
typedef struct kphi_factor {
  kphi_real state[16];
} kphi_factor;
// What kphi_factor_estimate says: there is enough to tell, and the flown k are wrong by more than their +-.
enum { KPHI_FACTOR_KNOWN = 1, KPHI_FACTOR_WRONG = 2 };

// 1 unless a setting is outside its range: mass [kg] and period [s] > 0, memory at least 100 periods, flown_error, half
// of the 95 % interval of the flown k, relative, in [0, 1).
int kphi_factor_build(kphi_factor* out, kphi_real mass, kphi_real period_s, kphi_real memory_s, kphi_real flown_error);
// Each period, in free flight: the accelerometer's z (up) [m/s^2], and the sum of k_i w_i^2 [N]. What cannot be used is
// left out.
void kphi_factor_update(kphi_factor* factor, kphi_real specific_force, kphi_real told_n);
// The sum of the flags above; thrust flown over thrust told, and its standard uncertainty, HUGE_VAL unless known.
int kphi_factor_estimate(const kphi_factor* factor, kphi_real* value, kphi_real* u);
// Samples used and left out; may be null.
void kphi_factor_counts(const kphi_factor* factor, unsigned* used, unsigned* left_out);

#ifdef __cplusplus
}
#endif

#endif
