#include "drivers/sim/physics/plant.hpp"

namespace kphi::sim {

Plant::Plant(const PlantParameters& parameters, std::uint64_t seed) noexcept
    : density_share_(parameters.air_density_kg_m3 / 1.225),
      random_(seed),
      motor_(parameters.motor),
      load_cell_(parameters.load_cell, random_) {
  mount(nullptr, 0);
}

void Plant::mount(const PropellerTruth* propeller, double occlusion_deg) noexcept {
  air_ = AirLoad{};
  shaft_ = ShaftLoad{};
  if (propeller != nullptr) {
    air_.thrust = density_share_ * sim::thrust_coefficient(*propeller, occlusion_deg);
    air_.thrust_unoccluded = density_share_ * sim::thrust_coefficient(*propeller, 0);
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
