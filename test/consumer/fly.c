/* Prints the speed [RPM] of each rotor in O, every rotor asked for 1.5 N, then what hovering at 6 N asks of them, and
   the version. In C99, with the numbers that the library was built for. */
#include <stdio.h>

#include "compensation/kphi_compensation.h"

#define PI ((kphi_real)3.14159265358979323846)

int main(void) {
  const kphi_real k_t = (kphi_real)1.7e-8 * (30 / PI) * (30 / PI); /* N/RPM^2 in N/(rad/s)^2 */
  kphi_curve line = {0};
  line.thrust_coefficient = k_t;
  line.intercept = (kphi_real)1.03 * k_t;
  line.slope_per_rad = (kphi_real)-0.0028889 * k_t * 180 / PI;
  line.largest_fitted_rad = 270 * PI / 180;
  line.overlap = KPHI_RIM_ARC;
  if (kphi_curve_doubts(&line, KPHI_LAW_CLAMPED) != 0) return 1;

  kphi_airframe airframe = {0};
  airframe.half_side = (kphi_real)0.045;
  airframe.arm_length = (kphi_real)0.117;
  airframe.propeller_radius = (kphi_real)0.0635;
  airframe.fastest_speed = 19100 * PI / 30;
  for (int i = 0; i < 4; ++i) airframe.hinge_turns[i] = i;

  const kphi_curve lines[4] = {line, line, line, line};
  kphi_compensator compensator;
  const int refusal = kphi_compensator_build(&compensator, lines, &airframe, KPHI_LAW_CLAMPED);
  if (refusal != 0) {
    fprintf(stderr, "%s\n", kphi_refusal_text(refusal));
    return 1;
  }
  const kphi_real arms[4] = {PI, PI, (kphi_real)165.676 * PI / 180, PI};
  const kphi_real thrusts[4] = {(kphi_real)1.5, (kphi_real)1.5, (kphi_real)1.5, (kphi_real)1.5};
  kphi_real speeds[4];
  unsigned short flags[4];
  kphi_set_arms(&compensator, arms);
  kphi_speeds_for(&compensator, thrusts, speeds, flags);
  for (int i = 0; i < 4; ++i) printf("%.1f\n", (double)(speeds[i] * 30 / PI));

  const kphi_masses masses = {
      (kphi_real)0.42, {0, 0}, {(kphi_real)0.045, (kphi_real)0.045, (kphi_real)0.045, (kphi_real)0.045}};
  const int spins[4] = {1, -1, 1, -1};
  const kphi_real hover[4] = {6, 0, 0, 0}, smallest[4] = {0};
  kphi_real hubs[4][2], scale[4], largest[4], mixed[4];
  kphi_mixer mixer;
  kphi_hubs(&compensator, &masses, hubs);
  if (!kphi_mixer_build(&mixer, 4, (const kphi_real(*)[2])hubs, spins, (kphi_real)0.0133, 0)) return 1;
  kphi_drag_scale(&compensator, scale);
  kphi_thrust_max(&compensator, largest);
  if (!kphi_mixer_set_layout(&mixer, (const kphi_real(*)[2])hubs, spins, scale)) return 1;
  if (kphi_mix(&mixer, hover, smallest, largest, 0, mixed, NULL) != 0) return 1;
  printf("%.3f\n%s\n", (double)(mixed[0] + mixed[1] + mixed[2] + mixed[3]), kphi_compensation_version());
  return 0;
}
