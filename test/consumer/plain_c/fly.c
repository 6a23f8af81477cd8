/* Prints the speed [RPM] of each rotor in O, every rotor asked for 1.5 N, then what hovering at 6 N asks of them. */
#include <stdio.h>

#include "compensation/kphi_compensation.h"

static const double kPi = 3.14159265358979323846;

int main(void) {
  const double k_t = 1.7e-8 * (30 / kPi) * (30 / kPi); /* N/RPM^2 in N/(rad/s)^2 */
  kphi_line line = {0};
  line.thrust_coefficient = k_t;
  line.intercept = 1.03 * k_t;
  line.slope_per_rad = -0.0028889 * k_t * 180 / kPi;
  line.largest_fitted_rad = 270 * kPi / 180;
  line.overlap = KPHI_RIM_ARC;

  kphi_airframe airframe = {0};
  airframe.half_side = 0.045;
  airframe.arm_length = 0.117;
  airframe.propeller_radius = 0.0635;
  airframe.fastest_speed = 19100 * kPi / 30;
  for (int i = 0; i < 4; ++i) airframe.hinge_turns[i] = i;

  const kphi_line lines[4] = {line, line, line, line};
  kphi_compensator compensator;
  const int refusal = kphi_compensator_build(&compensator, lines, &airframe, KPHI_LAW_CLAMPED);
  if (refusal != 0) {
    fprintf(stderr, "%s\n", kphi_refusal_text(refusal));
    return 1;
  }
  const double arms[4] = {kPi, kPi, 165.676 * kPi / 180, kPi};
  const double thrusts[4] = {1.5, 1.5, 1.5, 1.5};
  double speeds[4];
  unsigned char flags[4];
  kphi_set_arms(&compensator, arms);
  kphi_speeds_for(&compensator, thrusts, speeds, flags);
  for (int i = 0; i < 4; ++i) printf("%.1f\n", speeds[i] * 30 / kPi);

  const double hubs[4][2] = {{-.072, .045}, {-.045, -.072}, {.0684, -.0739}, {.045, .072}};
  const int spins[4] = {1, -1, 1, -1};
  const double hover[4] = {6, 0, 0, 0}, smallest[4] = {0};
  double scale[4], largest[4], mixed[4];
  kphi_mixer mixer;
  if (!kphi_mixer_build(&mixer, hubs, spins, 0.0133, 0)) return 1;
  kphi_drag_scale(&compensator, scale);
  kphi_thrust_max(&compensator, largest);
  if (!kphi_mixer_set_layout(&mixer, hubs, spins, scale)) return 1;
  if (kphi_mix(&mixer, hover, smallest, largest, 0, mixed, NULL) != 0) return 1;
  printf("%.4f\n", mixed[0] + mixed[1] + mixed[2] + mixed[3]);
  return 0;
}
