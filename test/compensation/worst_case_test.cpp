// What the dearest input costs beside a usual one, in instructions: the flying calls have no loop that the data could
// make long. Times are in `./run bench compensation_latency`.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "compensation/mixing.hpp"
#include "test/compensation/example_vehicle.hpp"
#include "test/compensation/instructions.hpp"

namespace kphi::compensation {
namespace worst_case_test {

using test::instructions_of;

class WorstCase : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::kInstructionsCanBeCounted) GTEST_SKIP() << "no trap flag here (another processor, or a sanitizer)";
  }

  struct Counts {
    std::vector<long> all;
    [[nodiscard]] long usual() const {
      std::vector<long> sorted = all;
      std::sort(sorted.begin(), sorted.end());
      return sorted[sorted.size() / 2];
    }
    [[nodiscard]] long dearest() const { return *std::max_element(all.begin(), all.end()); }
  };

  /// `call(i)` for i from 0 to count − 1; the report of the tests tells what was counted.
  template <class Call>
  static Counts counted(const std::string& what, int count, const Call& call) {
    Counts counts;
    for (int i = 0; i < count; ++i) call(i);
    for (int i = 0; i < count; ++i) counts.all.push_back(instructions_of([&] { call(i); }));
    RecordProperty(what + "_usual", static_cast<int>(counts.usual()));
    RecordProperty(what + "_dearest", static_cast<int>(counts.dearest()));
    return counts;
  }

  static void expect_even(const Counts& usual, const Counts& all, long at_least) {
    EXPECT_GT(usual.usual(), at_least) << "too few to be the call at all";
    EXPECT_LE(all.dearest(), 2.5 * static_cast<double>(usual.usual()));
  }
};

TEST_F(WorstCase, TheCountIsExact) {
  const auto thousand = [] { asm volatile(".rept 1000\n nop\n .endr"); };
  const auto one = [] { asm volatile("nop"); };
  EXPECT_EQ(instructions_of(thousand) - instructions_of(one), 999);
}

TEST_F(WorstCase, OfSpeedsForIsNotFarFromAUsualCall) {
  const Compensator compensator = with_arms(shape_o());
  std::vector<std::array<Newtons, 4>> odd = {thrusts_of(0, 5.3, -1, 100)};
  for (const double one : {0.0, kNaN, kInfinity, -kInfinity, 5e-324, 1e308, -1.0, 1e3}) {
    odd.push_back(thrusts_of(one, one, one, one));
    odd.push_back(thrusts_of(1.5, one, 1.5, 1.5));
  }
  volatile double sink = 0;
  const auto count = [&](const std::string& what, const std::vector<std::array<Newtons, 4>>& thrusts) {
    return counted(what, static_cast<int>(thrusts.size()), [&](int i) {
      sink = compensator.speeds_for(thrusts[static_cast<std::size_t>(i)]).speeds[3].value();
    });
  };
  const Counts in_flight = count("speeds_for", {thrusts_of(1.4, 1.5, 1.6, 1.7), thrusts_of(0.5, 2, 3, 1)});
  expect_even(in_flight, count("speeds_for_odd", odd), 20);
}

Airframe hexagonal_airframe() {
  Airframe airframe = example_airframe();
  airframe.polygon = PolygonBody{regular_polygon(6, 0.06), Rotors<Hinge>(4)};
  for (std::size_t i = 0; i < 4; ++i) {
    const Radians turn(kPi / 2 * static_cast<double>(i));
    airframe.polygon->hinges[i] = {at(0.05 * std::cos(turn.value()), 0.05 * std::sin(turn.value())), turn};
  }
  return airframe;
}

/// Four arms over the body, from first contact to O and a little beyond, all moved at every call.
TEST_F(WorstCase, OfSetArmsIsAUsualOneOfArmsOverTheBodyInEveryMeasureOnEveryBody) {
  for (Airframe airframe : {example_airframe(), hexagonal_airframe()}) {
    for (const OverlapMeasureName& entry : kOverlapMeasureNames) {
      airframe.overlap = entry.measure;
      Compensator compensator = compensator_of(airframe);
      const std::string what = std::string(entry.name) + (airframe.polygon ? "_hexagon" : "_square");
      SCOPED_TRACE(what);
      const Counts counts = counted(what, 6, [&](int i) { compensator.set_arms(all_at(147.6 + 6.7 * i)); });
      expect_even(counts, counts, 300);
    }
  }
}

TEST_F(WorstCase, OfSetArmsIsNowhereBeyondThatOfArmsOverTheBody) {
  Compensator compensator = example_compensator();
  const auto set = [&](double theta) { compensator.set_arms(all_at(theta)); };
  const Counts over = counted("over_body", 9, [&](int i) { set(150 + 3.7 * i); });
  const double odd[] = {-180, -90, -57.4, 45, 46, 147.4, 90, 359, 720, 1e6, 1e15, kNaN, kInfinity, 1e300};
  const Counts any = counted("any_angle", static_cast<int>(std::size(odd)), [&](int i) { set(odd[i]); });
  expect_even(over, any, 300);
}

TEST_F(WorstCase, OfMixingIsBounded) {
  for (const double per_square_newton : {0.0, 5e-4}) {
    const Mixer mixer = *Mixer::build(example_layout(shape_o()), {Metres(0.0133), per_square_newton});
    const ThrustLimits limits{{}, thrusts_of(5.2, 5.2, 5.6, 5.2)};
    const double demands[][4] = {{6, 0.02, -0.03, 0.005}, {6, 0, 0, 0.1},       {20, 0.2, -0.1, 0.05},
                                 {40, 0, 0, 0},           {0, 0.1, 0, 0},       {6, 9, -9, 9},
                                 {-5, 0.3, 0.3, -1},      {1e9, 1e9, 1e9, 1e9}, {6, kNaN, kNaN, 0.1},
                                 {6, 0.3, 0, 0.1},        {18, 0, 0.3, -0.06},  {6, 0, 0, kInfinity}};
    volatile double sink = 0;
    const Counts counts =
        counted(per_square_newton == 0 ? "mix" : "mix_iterated", static_cast<int>(std::size(demands)), [&](int i) {
          const double* d = demands[i];
          sink = mixer.mix({Newtons(d[0]), NewtonMetres(d[1]), NewtonMetres(d[2]), NewtonMetres(d[3])}, limits)
                     .achieved.thrust.value();
        });
    EXPECT_LE(counts.dearest(), per_square_newton == 0 ? 20'000 : 80'000)
        << "at most four searches where κ depends on f";
  }
}

}  // namespace worst_case_test
}  // namespace kphi::compensation
