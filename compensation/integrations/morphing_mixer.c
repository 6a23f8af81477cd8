#include "morphing_mixer.h"

#include <stddef.h>

const char* morphingInit(morphingState_t* state, const morphingVehicle_t* vehicle, const float* armAngles) {
  const int refusal =
      kphi_compensator_build(&state->compensator, vehicle->curves, &vehicle->airframe, KPHI_LAW_CLAMPED);
  if (refusal != 0) return kphi_refusal_text(refusal);
  state->vehicle = vehicle;
  state->rotors = vehicle->airframe.rotors != 0 ? vehicle->airframe.rotors : 4;
  state->flags = state->conceded = 0;
  kphi_set_arms(&state->compensator, armAngles);
  float hubs[KPHI_MAX_ROTORS][2];
  kphi_hubs(&state->compensator, &vehicle->masses, hubs);
  if (!kphi_mixer_build(&state->mixer, state->rotors, (const float(*)[2])hubs, vehicle->spins, vehicle->dragPerNewton,
                        0)) {
    return "the rotors of this shape cannot make every torque; check arm angles, spins and masses";
  }
  state->shapeFlies = true;
  return NULL;
}

void morphingArms(morphingState_t* state, const float* armAngles, const float* rates, float age) {
  float hubs[KPHI_MAX_ROTORS][2], scale[KPHI_MAX_ROTORS];
  kphi_set_moving_arms(&state->compensator, armAngles, rates, age);
  kphi_hubs(&state->compensator, &state->vehicle->masses, hubs);
  kphi_drag_scale(&state->compensator, scale);
  state->shapeFlies = kphi_mixer_set_layout(&state->mixer, (const float(*)[2])hubs, state->vehicle->spins, scale) != 0;
}

void morphingMix(morphingState_t* state, float thrust, float roll, float pitch, float yaw, float* throttle) {
  static const float none[KPHI_MAX_ROTORS] = {0};
  const float wrench[4] = {thrust, roll, pitch, yaw};
  float most[KPHI_MAX_ROTORS], thrusts[KPHI_MAX_ROTORS], uncovered[KPHI_MAX_ROTORS], speeds[KPHI_MAX_ROTORS];
  unsigned short flags[KPHI_MAX_ROTORS];
  kphi_thrust_max(&state->compensator, most);
  state->conceded = (uint32_t)kphi_mix(&state->mixer, wrench, none, most, state->vehicle->assuredYaw, thrusts, NULL);
  kphi_uncovered_thrusts(&state->compensator, thrusts, uncovered);
  kphi_speeds_for(&state->compensator, thrusts, speeds, flags); /* for its flags */
  state->flags = 0;
  for (int i = 0; i < state->rotors; ++i) {
    throttle[i] = kphi_throttle(state->vehicle->fullThrust, state->vehicle->thrustCurve, uncovered[i]);
    state->flags |= flags[i];
  }
}
