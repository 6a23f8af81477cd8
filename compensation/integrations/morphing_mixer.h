// Betaflight, Crazyflie and other stacks in C: the mixer of a morphing multirotor. C99, float; build the library with
// KPHI_COMPENSATION_FLOAT. No allocation, no lock; call from one task.
#ifndef MORPHING_MIXER_H
#define MORPHING_MIXER_H

#include <stdbool.h>
#include <stdint.h>

#include "compensation/kphi_compensation.h"

typedef struct morphingVehicle_s {
  kphi_airframe airframe;
  kphi_masses masses;
  kphi_curve curves[KPHI_MAX_ROTORS];
  int spins[KPHI_MAX_ROTORS];  // +1 where the drag torque points up
  float dragPerNewton;         // N m/N
  float fullThrust;            // N, of an uncovered rotor at throttle 1
  float thrustCurve;           // share of the square in it, as PX4's THR_MDL_FAC; 1: T ~ throttle^2
  float assuredYaw;            // N m
} morphingVehicle_t;

typedef struct morphingState_s {
  kphi_compensator compensator;
  kphi_mixer mixer;
  const morphingVehicle_t* vehicle;
  int rotors;
  bool shapeFlies;    // false: the shape of the last arm angles cannot be flown, the one before is kept
  uint32_t flags;     // KPHI_... of all rotors at the last mix
  uint32_t conceded;  // KPHI_GAVE_...
} morphingState_t;

// NULL, or why the vehicle cannot be flown. `armAngles` [rad]: the shape at rest. The vehicle must stay where it is.
const char* morphingInit(morphingState_t* state, const morphingVehicle_t* vehicle, const float* armAngles);
// At the rate of the servos' feedback: [rad], [rad/s], and how old it is [s].
void morphingArms(morphingState_t* state, const float* armAngles, const float* rates, float age);
// In the loop: thrust [N] and torques [N m], x forward, y left, z up, to throttle 0..1 of each rotor.
void morphingMix(morphingState_t* state, float thrust, float roll, float pitch, float yaw, float* throttle);

#endif
