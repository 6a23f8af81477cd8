// The second witness: flights of `kphi fly`, whose air, geometry and controller were written for another purpose.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "compensation/flight/flight.hpp"
#include "fit/flights/flight_fit.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::fit {
namespace flown_by_fly_test {

using flight::TraceRow;

/// What an accelerometer in the middle of the body feels, by differences of its place, and what else a log has.
FlightLog log_of(const std::vector<TraceRow>& rows) {
  FlightLog log;
  log.format = "kphi fly";
  log.rotor_speed.resize(rows.front().speeds.size());
  log.arm_angle.resize(rows.front().arms.size());
  const auto put = [](FlightChannel& to, double time, double value) {
    to.time_s.push_back(time);
    to.values.push_back(value);
  };
  for (std::size_t n = 1; n + 1 < rows.size(); ++n) {
    const double step = rows[n + 1].time - rows[n].time, time = rows[n].time;
    const Eigen::Vector3d moves =
        (rows[n + 1].truth - 2 * rows[n].truth + rows[n - 1].truth) / (step * step) + Eigen::Vector3d(0, 0, 9.80665);
    const auto& turned = rows[n].rotation;
    const Eigen::Matrix3d body = (Eigen::AngleAxisd(turned.z(), Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(turned.y(), Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(turned.x(), Eigen::Vector3d::UnitX()))
                                     .toRotationMatrix();
    const Eigen::Vector3d felt = body.transpose() * moves;
    for (std::size_t axis = 0; axis < 3; ++axis)
      put(log.specific_force[axis], time, felt[static_cast<Eigen::Index>(axis)]);
    for (std::size_t i = 0; i < log.rotor_speed.size(); ++i) {
      put(log.rotor_speed[i], time, rows[n].speeds[i]);
      put(log.arm_angle[i], time, rows[n].arms[i]);
    }
    put(log.height, time, rows[n].truth.z());
    put(log.climb, time, (rows[n + 1].truth.z() - rows[n - 1].truth.z()) / (2 * step));
  }
  return log;
}

/// Thrust per squared speed of rotor 0 at its widest φ over that where nothing covers it.
double true_ratio(const std::vector<TraceRow>& rows) {
  const TraceRow *open = &rows.front(), *wide = open;
  for (const TraceRow& row : rows) {
    if (row.occlusions[0] > wide->occlusions[0]) wide = &row;
    if (row.occlusions[0] == 0) open = &row;
  }
  const auto k = [](const TraceRow& row) { return row.thrusts[0] / (row.speeds[0] * row.speeds[0]); };
  return k(*wide) / k(*open);
}

TEST(FlightsOfKphiFly, TellTheirWorld) {
  const flight::Scene scene = flight::example_scene();
  const flight::Shadow shadow(scene.vehicle);
  LoggedVehicle vehicle;
  vehicle.airframe = scene.vehicle.airframe;
  vehicle.build = scene.vehicle.build;
  vehicle.build_known = true;
  vehicle.mass_kg = scene.vehicle.build.mass_kg * scene.truth.mass;  // as a balance would tell
  for (const auto index : {flight::kHoverPlain, flight::kLevelPlain, flight::kRisingCompensated}) {
    std::vector<TraceRow> rows;
    const auto flown = flight::fly(flight::kExperiments[index], scene, shadow, &rows);
    ASSERT_FALSE(flown.lost);
    const FlightFit fit = fit_flight(flown_bins(log_of(rows), vehicle), vehicle);
    const char* const name = flight::kExperiments[index].name.data();
    double share = 0;
    for (std::size_t i = 0; i < 4; ++i) share += scene.truth.thrust[i] / 4;
    const double k_t = scene.truth.thrust_coefficient.value() * share;
    EXPECT_LT(std::abs(fit.k_t - k_t), 1.5 * 1.96 * fit.k_t_u) << name << ": " << fit.k_t / k_t;
    ASSERT_FALSE(fit.alone()) << name;
    const double truth = true_ratio(rows);
    EXPECT_LT(std::abs(fit.ratio().value - truth), 0.01)
        << name << ": " << fit.ratio().value << " for " << truth << ", u " << fit.ratio().u;
    EXPECT_LT(std::abs(fit.ratio().value - truth), 1.5 * expanded(fit.ratio())) << name;
    EXPECT_FALSE(fit.rotors_told) << "without angular rates";
  }
}

}  // namespace flown_by_fly_test
}  // namespace kphi::fit
