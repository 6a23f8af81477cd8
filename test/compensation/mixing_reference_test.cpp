// The mixer within limits against the solvers of ALGLIB (quadratic programs) and Clp (linear ones): each demand of its
// order, one after the other, comes as near as it can.
#include <gtest/gtest.h>

#ifdef KPHI_SOLVERS
#include <libalglib/optimization.h>
#include <malloc.h>

#include <ClpSimplex.hpp>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "compensation/mixing.hpp"
#include "test/compensation/odd_numbers.hpp"

namespace kphi::compensation {
namespace mixing_reference_test {

constexpr double kKappa = 0.0133;
/// Of the largest thrust a rotor can give: newtons, and newton metres on an arm of one metre.
constexpr double kSame = 1e-6;

/// A vehicle with its limits, and a demand that they may not allow.
struct Case {
  RotorLayout layout;
  Rotors<Real> drag_scale;
  ThrustLimits limits;
  Wrench demand;
  double assured_yaw;
  [[nodiscard]] std::size_t rotors() const { return layout.hubs.size(); }
};

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  Case any() {
    const std::size_t count = 3 + random_() % 6;
    Case drawn;
    drawn.layout = {Rotors<HubPosition>(count), Rotors<int>(count)};
    drawn.drag_scale = Rotors<Real>(count);
    drawn.limits = {Rotors<Newtons>(count), Rotors<Newtons>(count)};
    const bool regular = random_() % 4 == 0, from_zero = random_() % 2 == 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double angle = 2 * kPi * (static_cast<double>(i) + 0.5) / static_cast<double>(count);
      const double off = regular ? 0 : between(-0.08, 0.08), across = regular ? 0 : between(-0.08, 0.08);
      drawn.layout.hubs[i] = {Metres(0.18 * std::cos(angle) + off), Metres(0.18 * std::sin(angle) + across)};
      drawn.layout.spins[i] = i % 2 == 0 ? 1 : -1;
      drawn.drag_scale[i] = regular ? 1 : between(1, 1.5);
      drawn.limits.smallest[i] = Newtons(from_zero ? 0 : between(0, 0.5));
      drawn.limits.largest[i] = Newtons(regular ? 4 : between(2, 6));
    }
    const auto reach = 0.3 * static_cast<double>(count);
    drawn.demand = {Newtons(between(0, 5.0 * static_cast<double>(count))), NewtonMetres(between(-reach, reach)),
                    NewtonMetres(between(-reach, reach)), NewtonMetres(between(-0.2, 0.2))};
    if (random_() % 4 == 0) drawn.demand.pitch = NewtonMetres(0);
    if (random_() % 4 == 0) drawn.demand.yaw = NewtonMetres(0);
    drawn.assured_yaw = between(0, 0.05);
    return drawn;
  }

 private:
  std::mt19937_64 random_;
};

/// What can be asked of the thrusts: [thrust; roll; pitch; yaw] = rows f.
struct Rows {
  explicit Rows(const Case& of) : count(static_cast<alglib::ae_int_t>(of.rotors())) {
    for (auto* row : {&thrust, &roll, &pitch, &yaw, &low, &high}) row->setlength(count);
    for (std::size_t i = 0; i < of.rotors(); ++i) {
      const auto at = static_cast<alglib::ae_int_t>(i);
      thrust[at] = 1;
      roll[at] = of.layout.hubs[i].y.value();
      pitch[at] = -of.layout.hubs[i].x.value();
      yaw[at] = of.layout.spins[i] * kKappa * of.drag_scale[i];
      low[at] = of.limits.smallest[i].value();
      high[at] = of.limits.largest[i].value();
    }
  }
  alglib::ae_int_t count;
  alglib::real_1d_array thrust, roll, pitch, yaw, low, high;
};

struct Held {
  const alglib::real_1d_array* row;
  double low, high;
};

/// The smallest (sign 1) or largest (−1) that `row` can give while the others are held.
double extreme(const Rows& rows, const alglib::real_1d_array& row, double sign, const std::vector<Held>& held) {
  const int count = static_cast<int>(rows.count);
  ClpSimplex problem;
  problem.setLogLevel(0);
  problem.resize(0, count);
  problem.setOptimizationDirection(sign);
  std::vector<int> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), 0);
  for (int i = 0; i < count; ++i) {
    problem.setColBounds(i, rows.low[i], rows.high[i]);
    problem.setObjCoeff(i, row[i]);
  }
  problem.addRow(count, all.data(), rows.thrust.getcontent(), -COIN_DBL_MAX, COIN_DBL_MAX);  // it wants one
  for (const Held& one : held) problem.addRow(count, all.data(), one.row->getcontent(), one.low, one.high);
  problem.setPrimalTolerance(1e-11);
  problem.setDualTolerance(1e-11);
  problem.scaling(0);
  problem.primal();
  if (!problem.isProvenOptimal()) return kNaN;
  // Now and then it calls a solution optimal that breaks a limit or a row.
  const double* found = problem.primalColumnSolution();
  const auto breaks = [](double value, double low, double high) {
    return !(value > low - 1e-9 && value < high + 1e-9);
  };
  for (int i = 0; i < count; ++i) {
    if (breaks(found[i], rows.low[i], rows.high[i])) return kNaN;
  }
  for (const Held& one : held) {
    if (breaks(std::inner_product(found, found + count, one.row->getcontent(), 0.0), one.low, one.high)) return kNaN;
  }
  return problem.objectiveValue();
}

/// The least distance of (roll, pitch) from what is demanded, with yaw held.
double least_distance(const Rows& rows, double roll, double pitch, const std::vector<Held>& held) {
  alglib::minqpstate state;
  alglib::minqpcreate(rows.count, state);
  alglib::real_2d_array square;
  alglib::real_1d_array linear, start;
  square.setlength(rows.count, rows.count);
  linear.setlength(rows.count);
  for (alglib::ae_int_t i = 0; i < rows.count; ++i) {
    for (alglib::ae_int_t j = 0; j < rows.count; ++j)
      square[i][j] = rows.roll[i] * rows.roll[j] + rows.pitch[i] * rows.pitch[j];
    linear[i] = -(rows.roll[i] * roll + rows.pitch[i] * pitch);
  }
  alglib::minqpsetquadraticterm(state, square);
  alglib::minqpsetlinearterm(state, linear);
  alglib::minqpsetbc(state, rows.low, rows.high);
  for (const Held& one : held) alglib::minqpaddlc2dense(state, *one.row, one.low, one.high);
  alglib::minqpsetalgodenseipm(state, 1e-14);
  alglib::minqpoptimize(state);
  alglib::real_1d_array found;
  alglib::minqpreport report;
  alglib::minqpresults(state, found, report);
  if (report.terminationtype <= 0) return kNaN;
  double a = -roll, b = -pitch;
  for (alglib::ae_int_t i = 0; i < rows.count; ++i) {
    a += rows.roll[i] * found[i];
    b += rows.pitch[i] * found[i];
  }
  return std::hypot(a, b);
}

/// What of `row` is nearest to [low, high].
double nearest(const Rows& rows, const alglib::real_1d_array& row, double low, double high,
               const std::vector<Held>& held) {
  const double least = extreme(rows, row, 1, held), most = extreme(rows, row, -1, held);
  if (std::isnan(least) || std::isnan(most)) return kNaN;
  if (most < low) return most;
  return least > high ? least : std::min(std::max(low, least), high);
}

struct Tally {
  int saturated = 0, unsolved = 0, short_of_roll = 0, short_of_yaw = 0, other_sign = 0, most_steps = 0;
  double worst = 0;
};

/// Checks one case, if it is saturated.
void check(const Case& of, Tally& tally) {
  auto mixer = Mixer::build(of.layout, {Metres(kKappa), 0});
  if (!mixer || !mixer->set_layout(of.layout, of.drag_scale)) return;
  const MixedThrusts mixed = mixer->mix(of.demand, of.limits, NewtonMetres(of.assured_yaw));
  if (mixed.steps == 0) return;
  ++tally.saturated;
  tally.most_steps = std::max(tally.most_steps, mixed.steps);
  const Rows rows(of);
  const double asked = of.demand.yaw.value(), yaw = mixed.achieved.yaw.value();
  const double roll = mixed.achieved.roll.value(), pitch = mixed.achieved.pitch.value();
  const bool yaws = of.rotors() > 3;
  const double sign = asked < 0 ? -1 : 1, assured = std::min(of.assured_yaw, std::fabs(asked));
  const auto off = [&](double got, double wanted) {
    if (std::isnan(wanted)) return void(++tally.unsolved);
    tally.worst = std::max(tally.worst, std::fabs(got - wanted));
    EXPECT_NEAR(got, wanted, kSame * 6);
  };
  std::vector<Held> held;
  const double missed = std::hypot(roll - of.demand.roll.value(), pitch - of.demand.pitch.value());
  off(missed, least_distance(rows, of.demand.roll.value(), of.demand.pitch.value(), held));
  tally.short_of_roll += missed > 1e-6;
  held.push_back({&rows.roll, roll, roll});
  held.push_back({&rows.pitch, pitch, pitch});
  if (yaws) {
    const double from = std::min(sign * assured, asked), to = std::max(sign * assured, asked);
    const double next = nearest(rows, rows.yaw, from, to, held);
    const double short_by = std::max({0.0, from - yaw, yaw - to});
    off(short_by, std::isnan(next) ? kNaN : std::max({0.0, from - next, next - to}));
    tally.short_of_yaw += short_by > 1e-6;
    tally.other_sign += yaw * sign < -1e-6;
    held.push_back(short_by > 1e-9 ? Held{&rows.yaw, yaw, yaw} : Held{&rows.yaw, from, to});
  }
  const double thrust = mixed.achieved.thrust.value(), wanted = of.demand.thrust.value();
  off(thrust, nearest(rows, rows.thrust, wanted, wanted, held));
  if (yaws) {
    held.push_back({&rows.thrust, thrust, thrust});
    off(yaw, nearest(rows, rows.yaw, asked, asked, held));
  }
}

#ifdef KPHI_SANITIZED
constexpr int kCases = 2'000;  // ten times as slow
#else
constexpr int kCases = 25'000;
#endif

class AgainstReference : public testing::TestWithParam<unsigned> {};

TEST_P(AgainstReference, EachDemandComesAsNearAsThoseBeforeItAllow) {
  mallopt(M_TRIM_THRESHOLD, 1 << 26);  // the solvers ask for the same memory again and again
  Draw draw(GetParam());
  Tally tally;
  while (tally.saturated < kCases && !HasFailure()) check(draw.any(), tally);
  RecordProperty("most_steps", tally.most_steps);
  RecordProperty("worst_difference", std::to_string(tally.worst));
  EXPECT_GT(tally.short_of_roll, kCases / 5);
  EXPECT_GT(tally.short_of_yaw, kCases / 25);
  EXPECT_GT(tally.other_sign, kCases / 1000) << "to keep roll and pitch";
  EXPECT_LT(tally.unsolved, 50) << "by the reference";
  std::printf(
      "%d saturated, %d short of roll and pitch, %d of the assured yaw, %d with yaw the other way, %d steps at most, "
      "worst %.1e, %d unsolved\n",
      tally.saturated, tally.short_of_roll, tally.short_of_yaw, tally.other_sign, tally.most_steps, tally.worst,
      tally.unsolved);
}

INSTANTIATE_TEST_SUITE_P(Seeds, AgainstReference, testing::Values(1u, 2u, 3u, 4u));

}  // namespace mixing_reference_test
}  // namespace kphi::compensation
#else
TEST(AgainstReference, EachDemandComesAsNearAsThoseBeforeItAllow) {
  GTEST_SKIP() << "needs libalglib-dev and coinor-libclp-dev: `./run peers` installs them";
}
#endif
