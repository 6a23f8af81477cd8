// kphi_compensation for Python: the library that flies, under the names that it has in C++. SI; arrays are numpy's, one
// number for each rotor, or rows of them where a call says so. What C++ refuses raises ValueError with the same words.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "compensation/compensator.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "compensation/kphi_compensation.h"
#include "compensation/mixing.hpp"
#include "compensation/throttle.hpp"

namespace py = pybind11;
using namespace kphi;
using namespace kphi::compensation;

namespace {

static_assert(sizeof(Real) == sizeof(double), "the module computes in double");

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

[[noreturn]] void refuse(const std::string& why) { throw py::value_error(why); }

/// A number of each rotor.
template <class T>
Rotors<T> rotors_of(const Numbers& numbers, const char* what) {
  if (numbers.ndim() != 1 || numbers.size() > static_cast<py::ssize_t>(kMostRotors))
    refuse(std::string(what) + ": a number for each of at most 8 rotors");
  Rotors<T> rotors(static_cast<std::size_t>(numbers.size()));
  for (std::size_t i = 0; i < rotors.size(); ++i) rotors[i] = T(numbers.data()[i]);
  return rotors;
}
double value_of(double value) { return value; }
template <class Unit>
double value_of(Quantity<Unit> value) {
  return value.value();
}
template <class T>
Numbers numbers_of(const Rotors<T>& rotors) {
  Numbers numbers(static_cast<py::ssize_t>(rotors.size()));
  for (std::size_t i = 0; i < rotors.size(); ++i) numbers.mutable_data()[i] = value_of(rotors[i]);
  return numbers;
}
template <class T>
py::object value_or_none(const std::optional<T>& value) {
  return value ? py::cast(value_of(*value)) : py::none();
}

/// `of(Radians)` of each number of an array of any shape.
template <class Of>
auto over(const Of& of) {
  return [of](const ThrustCurve& curve, const py::object& phi) {
    return py::vectorize([&](double one) { return value_of(of(curve, Radians(one))); })(phi);
  };
}

std::vector<Knot> knots_of(const Numbers& phi, const Numbers& values) {
  if (phi.ndim() != 1 || values.ndim() != 1 || phi.size() != values.size()) refuse("as many values as angles");
  std::vector<Knot> knots;
  for (py::ssize_t i = 0; i < phi.size(); ++i) knots.push_back({Radians(phi.data()[i]), values.data()[i]});
  return knots;
}

Position at(double x, double y) { return {Metres(x), Metres(y)}; }

PolygonBody polygon_of(const Numbers& corners, const py::sequence& hinges) {
  if (corners.ndim() != 2 || corners.shape(1) != 2) refuse("corners: rows of x, y");
  std::vector<Position> outline;
  for (py::ssize_t i = 0; i < corners.shape(0); ++i) outline.push_back(at(corners.at(i, 0), corners.at(i, 1)));
  const auto polygon = ConvexPolygon::from(outline.data(), outline.size());
  if (!polygon) refuse("corners: not those of a convex body in counter-clockwise order");
  if (hinges.size() < kFewestRotors || hinges.size() > kMostRotors) refuse("hinges: 3 to 8");
  PolygonBody body{*polygon, Rotors<Hinge>(hinges.size())};
  for (std::size_t i = 0; i < hinges.size(); ++i) body.hinges[i] = hinges[i].cast<Hinge>();
  return body;
}

Rotors<ThrustCurve> curves_of(const std::vector<ThrustCurve>& curves) {
  if (curves.empty() || curves.size() > kMostRotors) refuse(describe(Refusal::rotors));
  Rotors<ThrustCurve> rotors(curves.size(), curves.front());
  for (std::size_t i = 0; i < curves.size(); ++i) rotors[i] = curves[i];
  return rotors;
}

Compensator build(const std::vector<ThrustCurve>& curves, const Airframe& airframe, ScalingLaw law) {
  const BuildOutcome outcome = Compensator::build(curves_of(curves), airframe, law);
  if (!outcome.compensator) refuse(describe(outcome.refusal));
  return *outcome.compensator;
}

/// Of one set of thrusts, or of each row.
py::tuple speeds_for(const Compensator& compensator, const Numbers& thrusts) {
  const auto count = static_cast<py::ssize_t>(compensator.rotors());
  if (thrusts.ndim() < 1 || thrusts.ndim() > 2 || thrusts.shape(thrusts.ndim() - 1) != count)
    refuse("thrusts: a number for each rotor, or rows of them");
  const std::vector<py::ssize_t> shape(thrusts.shape(), thrusts.shape() + thrusts.ndim());
  Numbers speeds(shape);
  py::array_t<std::uint16_t> flags(shape);
  for (py::ssize_t row = 0; row < thrusts.size(); row += count) {
    Rotors<Newtons> asked(compensator.rotors());
    for (std::size_t i = 0; i < asked.size(); ++i)
      asked[i] = Newtons(thrusts.data()[row + static_cast<py::ssize_t>(i)]);
    const SpeedCommand command = compensator.speeds_for(asked);
    for (std::size_t i = 0; i < asked.size(); ++i) {
      speeds.mutable_data()[row + static_cast<py::ssize_t>(i)] = command.speeds[i].value();
      flags.mutable_data()[row + static_cast<py::ssize_t>(i)] = command.flags[i].bits();
    }
  }
  return py::make_tuple(speeds, flags);
}

Numbers numbers_of(const Wrench& wrench) {
  Numbers numbers(4);
  const double values[] = {wrench.thrust.value(), wrench.roll.value(), wrench.pitch.value(), wrench.yaw.value()};
  std::copy(values, values + 4, numbers.mutable_data());
  return numbers;
}

py::tuple mix(const Mixer& mixer, const Numbers& demand, const Numbers& largest, const py::object& smallest,
              double assured_yaw) {
  if (demand.ndim() != 1 || demand.size() != 4) refuse("demand: thrust [N], roll, pitch, yaw [N m]");
  const double* d = demand.data();
  ThrustLimits limits{{}, rotors_of<Newtons>(largest, "largest")};
  if (!smallest.is_none()) limits.smallest = rotors_of<Newtons>(smallest.cast<Numbers>(), "smallest");
  const MixedThrusts mixed = mixer.mix({Newtons(d[0]), NewtonMetres(d[1]), NewtonMetres(d[2]), NewtonMetres(d[3])},
                                       limits, NewtonMetres(assured_yaw));
  return py::make_tuple(numbers_of(mixed.thrusts), numbers_of(mixed.achieved), mixed.concessions.bits());
}

void add_curve(py::module_& module) {
  py::enum_<OverlapMeasure>(module, "OverlapMeasure")
      .value("rim_arc", OverlapMeasure::rim_arc)
      .value("area_share", OverlapMeasure::area_share)
      .value("load_share", OverlapMeasure::load_share);
  py::enum_<ScalingLaw>(module, "ScalingLaw")
      .value("clamped", ScalingLaw::clamped)
      .value("published", ScalingLaw::published);
  py::class_<ThrustCurve>(module, "ThrustCurve", "k(phi) of one propeller; phi in rad, k in N/(rad/s)^2.")
      .def_static(
          "from_line",
          [](double k_t, double intercept, double slope_per_rad, double largest_fitted, OverlapMeasure overlap) {
            const auto curve = ThrustCurve::from_line(ThrustCoefficient(k_t), ThrustCoefficient(intercept),
                                                      slope_per_rad, Radians(largest_fitted), overlap);
            if (!curve) refuse("K_T and intercept must be positive, the slope finite, largest_fitted in (0, 2 pi]");
            return *curve;
          },
          py::arg("thrust_coefficient"), py::arg("intercept"), py::arg("slope_per_rad"), py::arg("largest_fitted"),
          py::arg("overlap") = OverlapMeasure::rim_arc)
      .def_static(
          "from_table",
          [](const Numbers& phi, const Numbers& k, double largest_fitted, OverlapMeasure overlap) {
            const auto knots = knots_of(phi, k);
            const auto table = OcclusionTable::from(knots.data(), knots.size());
            const auto curve = table ? ThrustCurve::from_table(*table, Radians(largest_fitted), overlap) : std::nullopt;
            if (!curve) refuse("2 to 12 positive k that do not rise, at angles that ascend from 0");
            return *curve;
          },
          py::arg("phi"), py::arg("k"), py::arg("largest_fitted"), py::arg("overlap") = OverlapMeasure::rim_arc)
      .def("set_speed_trend",
           [](ThrustCurve& curve, double per_rad_s, double reference) {
             if (!curve.set_speed_trend({per_rad_s, RadPerSec(reference)}))
               refuse("a positive reference, and k may change by 0.3 from rest to it");
           })
      .def("set_torque_share",
           [](ThrustCurve& curve, const Numbers& phi, const Numbers& share) {
             const auto knots = knots_of(phi, share);
             const auto table = OcclusionTable::from(knots.data(), knots.size());
             if (!table || !curve.set_torque_share(*table)) refuse("shares in (0, 10) at angles that ascend from 0");
           })
      .def("at", over([](const ThrustCurve& c, Radians phi) { return c.at(phi); }), py::arg("phi"))
      .def("standard_error_at", over([](const ThrustCurve& c, Radians phi) { return c.standard_error_at(phi); }),
           py::arg("phi"))
      .def("torque_share_at", over([](const ThrustCurve& c, Radians phi) { return c.torque_share_at(phi); }),
           py::arg("phi"))
      .def(
          "scaling_factor",
          [](const ThrustCurve& curve, const py::object& phi, ScalingLaw law) {
            return py::vectorize([&](double one) { return curve.scaling_factor(Radians(one), law); })(phi);
          },
          py::arg("phi"), py::arg("law") = ScalingLaw::clamped)
      .def_property_readonly("thrust_coefficient", [](const ThrustCurve& c) { return c.thrust_coefficient().value(); })
      .def_property_readonly("largest_fitted", [](const ThrustCurve& c) { return c.largest_fitted().value(); })
      .def_property_readonly("overlap", &ThrustCurve::overlap)
      .def("__repr__", [](const ThrustCurve& c) { return "<ThrustCurve k = " + words_of(c) + " N/(rad/s)^2>"; });
}

void add_file(py::module_& module) {
  py::register_exception<CoefficientError>(module, "CoefficientError", PyExc_ValueError);
  py::class_<Coefficients>(module, "Coefficients", "What `kphi fit` wrote; None where the file does not say.")
      .def_readonly("curve", &Coefficients::curve)
      .def_readonly("origin", &Coefficients::origin)
      .def_readonly("verdict", &Coefficients::verdict)
      .def_property_readonly("propeller", [](const Coefficients& c) { return c.propeller.id; })
      .def_property_readonly("diameter_in", [](const Coefficients& c) { return c.propeller.diameter_in; })
      .def_property_readonly("blades", [](const Coefficients& c) { return c.propeller.blades; })
      .def_property_readonly("slowest_speed", [](const Coefficients& c) { return value_or_none(c.slowest_speed); })
      .def_property_readonly("fastest_speed", [](const Coefficients& c) { return value_or_none(c.fastest_speed); })
      .def_property_readonly("air_density_kg_m3",
                             [](const Coefficients& c) { return value_or_none(c.air_density_kg_m3); })
      .def_property_readonly("thrust_error_95",
                             [](const Coefficients& c) { return value_or_none(c.thrust_error.share_95); });
  module.def(
      "load_coefficients", [](const std::string& path) { return load_coefficients(path); }, py::arg("path"));
}

void add_airframe(py::module_& module) {
  py::class_<Hinge>(module, "Hinge")
      .def(py::init([](double x, double y, double turn, bool mirrored) {
             return Hinge{at(x, y), Radians(turn), mirrored};
           }),
           py::arg("x"), py::arg("y"), py::arg("turn"), py::arg("mirrored") = false);
  py::class_<Airframe>(module, "Airframe",
                       "Square body (half_side), or corners and hinges of any convex one. m, rad, rad/s.")
      .def(py::init([](double half_side, double arm_length, double propeller_radius, double slowest, double fastest,
                       std::array<int, 4> hinge_turns, std::array<bool, 4> mirrored, OverlapMeasure overlap,
                       const py::object& corners, const py::sequence& hinges, const py::object& radii,
                       const py::object& arms) {
             Airframe airframe{Metres(half_side), Metres(arm_length), Metres(propeller_radius), RadPerSec(slowest),
                               RadPerSec(fastest)};
             airframe.hinge_turns = hinge_turns;
             airframe.mirrored = mirrored;
             airframe.overlap = overlap;
             if (!corners.is_none()) airframe.polygon = polygon_of(corners.cast<Numbers>(), hinges);
             if (!radii.is_none())
               airframe.propeller_radii = rotors_of<Metres>(radii.cast<Numbers>(), "propeller_radii");
             if (!arms.is_none()) {
               const auto [from, to, stale] = arms.cast<std::array<double, 3>>();
               airframe.arms = {Radians(from), Radians(to), Radians(stale)};
             }
             return airframe;
           }),
           py::kw_only(), py::arg("half_side") = 0.0, py::arg("arm_length"), py::arg("propeller_radius"),
           py::arg("slowest_speed") = 0.0, py::arg("fastest_speed"),
           py::arg("hinge_turns") = std::array<int, 4>{0, 1, 2, 3}, py::arg("mirrored") = std::array<bool, 4>{},
           py::arg("overlap") = OverlapMeasure::rim_arc, py::arg("corners") = py::none(),
           py::arg("hinges") = py::tuple(), py::arg("propeller_radii") = py::none(), py::arg("arms") = py::none());
  py::class_<Masses>(module, "Masses", "kg and m: the body, its centre, what sits at each hub.")
      .def(py::init([](double body, const Numbers& at_hubs, std::array<double, 2> body_at) {
             return Masses{body, at(body_at[0], body_at[1]), rotors_of<double>(at_hubs, "at_hubs")};
           }),
           py::arg("body"), py::arg("at_hubs"), py::arg("body_at") = std::array<double, 2>{});
  py::class_<RotorLayout>(module, "RotorLayout", "Hubs about the centre of gravity [m], spins.")
      .def(py::init([](const Numbers& hubs, const std::vector<int>& spins) {
             if (hubs.ndim() != 2 || hubs.shape(1) != 2 || hubs.shape(0) != static_cast<py::ssize_t>(spins.size()) ||
                 spins.size() > kMostRotors)
               refuse("hubs: a row of x, y for each of at most 8 spins");
             RotorLayout layout{Rotors<HubPosition>(spins.size()), Rotors<int>(spins.size())};
             for (std::size_t i = 0; i < spins.size(); ++i) {
               const auto row = static_cast<py::ssize_t>(i);
               layout.hubs[i] = at(hubs.at(row, 0), hubs.at(row, 1));
               layout.spins[i] = spins[i];
             }
             return layout;
           }),
           py::arg("hubs"), py::arg("spins"))
      .def_property_readonly("hubs",
                             [](const RotorLayout& layout) {
                               Numbers hubs({static_cast<py::ssize_t>(layout.hubs.size()), py::ssize_t(2)});
                               for (std::size_t i = 0; i < layout.hubs.size(); ++i) {
                                 hubs.mutable_at(static_cast<py::ssize_t>(i), 0) = layout.hubs[i].x.value();
                                 hubs.mutable_at(static_cast<py::ssize_t>(i), 1) = layout.hubs[i].y.value();
                               }
                               return hubs;
                             })
      .def_property_readonly("spins", [](const RotorLayout& layout) {
        return std::vector<int>(layout.spins.begin(), layout.spins.end());
      });
}

void add_compensator(py::module_& module) {
  py::enum_<Flag>(module, "Flag", py::arithmetic())
      .value("thrust_nan", Flag::thrust_nan)
      .value("thrust_negative", Flag::thrust_negative)
      .value("speed_at_slowest", Flag::speed_at_slowest)
      .value("speed_at_fastest", Flag::speed_at_fastest)
      .value("arm_angle_unknown", Flag::arm_angle_unknown)
      .value("beyond_fit", Flag::beyond_fit)
      .value("at_floor", Flag::at_floor)
      .value("at_ceiling", Flag::at_ceiling)
      .value("arm_angle_beyond", Flag::arm_angle_beyond)
      .value("arm_angle_stale", Flag::arm_angle_stale);
  py::class_<Compensator>(module, "Compensator")
      .def_static("build", &build, py::arg("curves"), py::arg("airframe"), py::arg("law") = ScalingLaw::clamped)
      .def(
          "set_arms",
          [](Compensator& compensator, const Numbers& angles, const py::object& rates, double age) {
            ArmFeedback feedback;
            feedback.age = Seconds(age);
            if (!rates.is_none()) feedback.rates = rotors_of<RadPerSec>(rates.cast<Numbers>(), "rates");
            compensator.set_arms(rotors_of<Radians>(angles, "arm_angles"), feedback);
          },
          py::arg("arm_angles"), py::arg("rates") = py::none(), py::arg("age") = 0.0)
      .def("speeds_for", &speeds_for, py::arg("thrusts"),
           "Speeds [rad/s] and flags of thrusts [N], or of rows of them.")
      .def("uncovered_thrusts",
           [](const Compensator& c, const Numbers& thrusts) {
             return numbers_of(c.uncovered_thrusts(rotors_of<Newtons>(thrusts, "thrusts")));
           })
      .def(
          "speed_uncertainties",
          [](const Compensator& c, const std::vector<ThrustCurve>& curves, const Numbers& thrusts, double u) {
            return numbers_of(
                c.speed_uncertainties(curves_of(curves), rotors_of<Newtons>(thrusts, "thrusts"), Radians(u)));
          },
          py::arg("curves"), py::arg("thrusts"), py::arg("arm_angle_uncertainty") = 0.0)
      .def("enable", &Compensator::enable, py::arg("on"))
      .def_property_readonly("enabled", &Compensator::enabled)
      .def("set_air_density_ratio", &Compensator::set_air_density_ratio, py::arg("ratio"))
      .def(
          "layout",
          [](const Compensator& c, const Masses& masses, const std::vector<int>& spins) {
            if (spins.size() != c.rotors()) refuse("spins: one for each rotor");
            Rotors<int> of(spins.size());
            for (std::size_t i = 0; i < spins.size(); ++i) of[i] = spins[i];
            return c.layout(masses, of);
          },
          py::arg("masses"), py::arg("spins"))
      .def_property_readonly("occlusion_angles", [](const Compensator& c) { return numbers_of(c.occlusion_angles()); })
      .def_property_readonly("scaling_factors", [](const Compensator& c) { return numbers_of(c.scaling_factors()); })
      .def_property_readonly("thrust_max", [](const Compensator& c) { return numbers_of(c.thrust_max()); })
      .def_property_readonly("drag_scale", [](const Compensator& c) { return numbers_of(c.drag_scale()); })
      .def_property_readonly("rotors", &Compensator::rotors);
}

void add_mixer(py::module_& module) {
  py::enum_<Concession>(module, "Concession", py::arithmetic())
      .value("yaw", Concession::yaw)
      .value("thrust", Concession::thrust)
      .value("roll_pitch", Concession::roll_pitch)
      .value("demand_nan", Concession::demand_nan);
  py::class_<Mixer>(module, "Mixer")
      .def_static(
          "build",
          [](const RotorLayout& layout, double per_newton, double per_square_newton) {
            const auto mixer = Mixer::build(layout, {Metres(per_newton), per_square_newton});
            if (!mixer) refuse("the rotors of this layout cannot make every torque; check hubs, spins and drag torque");
            return *mixer;
          },
          py::arg("layout"), py::arg("per_newton"), py::arg("per_square_newton") = 0.0)
      .def(
          "set_layout",
          [](Mixer& mixer, const RotorLayout& layout, const py::object& drag_scale) {
            return mixer.set_layout(layout, drag_scale.is_none()
                                                ? Rotors<double>()
                                                : rotors_of<double>(drag_scale.cast<Numbers>(), "drag_scale"));
          },
          py::arg("layout"), py::arg("drag_scale") = py::none())
      .def("mix", &mix, py::arg("demand"), py::arg("largest"), py::arg("smallest") = py::none(),
           py::arg("assured_yaw") = 0.0,
           "Thrusts [N], the wrench that they make, and the sum of Concession for [thrust N, roll, pitch, yaw N m].")
      .def("wrench_of", [](const Mixer& mixer, const Numbers& thrusts) {
        return numbers_of(mixer.wrench_of(rotors_of<Newtons>(thrusts, "thrusts")));
      });
  module.def(
      "throttle_for",
      [](double full, double square_share, const py::object& thrust) {
        const ThrottleCurve curve{Newtons(full), square_share};
        return py::vectorize([&](double one) { return curve.throttle_for(Newtons(one)); })(thrust);
      },
      py::arg("full"), py::arg("square_share"), py::arg("thrust"));
}

}  // namespace

PYBIND11_MODULE(kphi_compensation, module) {
  module.doc() = "Thrust lost to the body under a propeller, and the speeds that make up for it. SI units.";
  module.attr("__version__") = KPHI_COMPENSATION_VERSION;
  add_curve(module);
  add_file(module);
  add_airframe(module);
  add_compensator(module);
  add_mixer(module);
}
