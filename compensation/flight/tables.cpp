#include "compensation/flight/tables.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/number.hpp"

namespace kphi::flight {
namespace {

/// `value` with `decimals` digits behind the dot, right-aligned in `width`.
std::string aligned(double value, int decimals, int width) {
  char digits[64];
  const int length = std::snprintf(digits, sizeof digits, "%*.*f", width, decimals, value);
  return std::string(digits, static_cast<std::size_t>(length));
}

/// `text`, left-aligned in `width` columns; counts the bytes of ASCII.
std::string padded(std::string text, std::size_t width) {
  if (text.size() < width) text.resize(width, ' ');
  return text;
}

// ---- for other programs ---------------------------------------------------------------------------------------------

constexpr std::size_t kFigureStride = 5;  // 50 ms

constexpr const char* kFigureHead =
    "set encoding utf8\n"
    "set border lc rgb '#777777'\n"
    "set tics nomirror textcolor rgb '#333333'\n"
    "set grid ytics lc rgb '#e4e4e4' lt 1 lw 0.8\n";

std::string terminal(int width, int height) {
  return "set terminal svg size " + std::to_string(width) + "," + std::to_string(height) +
         " noenhanced font 'Helvetica,Arial,sans-serif,14' linewidth 1.2 background '#ffffff'\n";
}

/// Fields and line ends of one CSV.
class Csv {
 public:
  explicit Csv(std::string header) : text_(std::move(header)) { text_ += '\n'; }
  Csv& add(const std::string& field) {
    if (text_.back() != '\n') text_ += ',';
    text_ += field;
    return *this;
  }
  Csv& add(double value) { return add(shortest(value)); }
  template <class Range>
  Csv& add_all(const Range& values) {
    for (const double value : values) add(value);
    return *this;
  }
  void end_row() { text_ += '\n'; }
  [[nodiscard]] std::string text() && { return std::move(text_); }

 private:
  std::string text_;
};

/// prefix1_unit, prefix2_unit and so on, for each rotor.
std::string each(std::size_t rotors, const std::string& prefix, const std::string& unit) {
  std::string names;
  for (std::size_t i = 1; i <= rotors; ++i) names += "," + prefix + std::to_string(i) + unit;
  return names;
}

/// Angles of arms, or shares of the hubs' ways.
std::string arms_columns(std::size_t rotors, bool on_ways, const std::string& what) {
  return each(rotors, on_ways ? "way" : "arm", what + (on_ways ? "" : "_rad"));
}

std::string leg_name(const Leg& leg) { return leg.shape == Shape::x ? "X" : leg.compensated ? "O c." : "O n.c."; }

/// Where a leg begins, what it is, and, in grey, the part of it that the tables average.
std::string leg_marks(const Experiment& experiment) {
  std::string marks;
  for (std::size_t i = 0; i < experiment.leg_count; ++i) {
    const double begins = static_cast<double>(i) * leg_seconds(experiment.path);
    const std::string at = shortest(begins);
    marks += "set object rectangle from " + shortest(begins + settle_seconds(experiment.path)) + ", graph 0 to " +
             shortest(begins + leg_seconds(experiment.path)) + ", graph 1 behind fc rgb '#f3f3f3' fs solid noborder\n";
    if (i > 0) marks += "set arrow from " + at + ", graph 0 to " + at + ", graph 1 nohead lc rgb '#999999' dt 2\n";
    marks +=
        "set label '" + leg_name(experiment.legs[i]) + "' at " + at + ", graph 0.91 offset 0.7,0 tc rgb '#555555'\n";
  }
  return marks;
}

}  // namespace

std::string findings_table(const Findings& found) {
  const auto percent = [](double share) { return aligned(100 * share, 1, 0) + " %"; };
  if (found.kept == 0) {
    return std::to_string(found.draws) +
           " draws, and a flight was lost in each: no percentiles (without compensation " +
           std::to_string(found.lost_plain) + ", with or in X " + std::to_string(found.lost_compensated) + ")\n\n";
  }
  std::string text = std::to_string(found.draws) + " draws; with a flight lost: " + std::to_string(found.lost_plain) +
                     " without compensation, " + std::to_string(found.lost_compensated) +
                     " with or in X. Percentiles are over the " + std::to_string(found.kept) + " others.\n" +
                     padded("", 34) + "      p10      p50      p90   paper\n";
  for (std::size_t i = 0; i < kMerits.size(); ++i) {
    if (*kMerits[i].title == '\0') continue;
    const auto& [p10, p50, p90] = found.merits[i];
    text += padded(kMerits[i].title, 34) + aligned(p10, 3, 9) + aligned(p50, 3, 9) + aligned(p90, 3, 9);
    text += std::string("   ") + kMerits[i].paper + "\n";
  }
  text += "better with compensation: hover z in " + percent(found.hover_z_better) + ", forward flight in " +
          percent(found.forward_better) +
          " of the draws,\ncounting those as better that were lost without compensation only\n";
  for (std::size_t law = 0; law < found.by_law.size(); ++law) {
    const Findings::OfLaw& of = found.by_law[law];
    if (of.kept == 0) continue;
    text += "median c. over n.c., law " + padded(name_of(static_cast<LossLaw>(law)), 18) + "hover z " +
            aligned(of.hover_z_ratio, 2, 0) + ", forward " + aligned(of.forward_ratio, 2, 0) + "\n";
  }
  return text + "\n";
}

std::string trace_csv(const std::vector<TraceRow>& trace) {
  const std::size_t n = trace.empty() ? 0 : trace.front().arms.size();
  const bool on_ways = !trace.empty() && trace.front().on_ways;
  Csv csv(
      "time_s,leg,reference_x_m,reference_y_m,reference_z_m,estimate_x_m,estimate_y_m,estimate_z_m,x_m,y_m,z_m,"
      "roll_rad,pitch_rad,yaw_rad" +
      arms_columns(n, on_ways, "") + arms_columns(n, on_ways, "_told") + each(n, "phi", "_rad") +
      each(n, "phi", "_believed_rad") + each(n, "k_i_", "") + each(n, "thrust", "_asked_n") + each(n, "thrust", "_n") +
      each(n, "speed", "_asked_rad_s") + each(n, "speed", "_rad_s"));
  for (const TraceRow& row : trace) {
    csv.add(row.time).add(std::to_string(row.leg + 1));
    csv.add_all(row.reference).add_all(row.estimate).add_all(row.truth).add_all(row.rotation);
    csv.add_all(row.arms).add_all(row.arms_told).add_all(row.occlusions).add_all(row.occlusions_believed);
    csv.add_all(row.scaling).add_all(row.thrusts_asked).add_all(row.thrusts);
    csv.add_all(row.speeds_asked).add_all(row.speeds);
    csv.end_row();
  }
  return std::move(csv).text();
}

std::string draws_csv(const std::vector<Draw>& draws) {
  const std::size_t n = draws.empty() ? 0 : draws.front().scene.vehicle.rotors();
  const bool on_ways = !draws.empty() && draws.front().scene.vehicle.ways.size() != 0;
  Csv csv("draw,law,gamma,mass,cog_x_m,cog_y_m,drag_per_s,wind_x_m_s,wind_y_m_s,kp_xy_per_s2,attitude_gain_per_s" +
          each(n, "thrust", "") + each(n, on_ways ? "way_error" : "arm_error", on_ways ? "" : "_rad") +
          each(n, on_ways ? "o_way" : "o_arm", on_ways ? "" : "_rad") +
          ",k_start,k_mean_slope_per_rad,lost_plain,lost_compensated,hover_z_plain_m,hover_z_compensated_m,"
          "hover_xy_plain_m,hover_xy_compensated_m,forward_x_m,forward_plain_m,forward_compensated_m,"
          "square_speed_ratio");
  for (std::size_t i = 0; i < draws.size(); ++i) {
    const Truth& truth = draws[i].scene.truth;
    const Gains& gains = draws[i].scene.pilot.gains;
    const compensation::ThrustCurve& curve = draws[i].scene.curves[0];
    const double k_t = curve.thrust_coefficient().value(), start = curve.at(Radians(0)).value();
    const double rise = curve.at(curve.largest_fitted()).value() - start;
    const Merits merits = merits_of(draws[i].flights);
    csv.add(std::to_string(i)).add(name_of(truth.law)).add(truth.gamma).add(truth.mass);
    csv.add_all(truth.cog_error).add(truth.drag).add_all(Eigen::Vector2d(truth.wind.head<2>()));
    csv.add(gains.position.x()).add(gains.attitude.x());
    for (std::size_t rotor = 0; rotor < n; ++rotor) csv.add(truth.thrust[rotor]);
    for (std::size_t rotor = 0; rotor < n; ++rotor) csv.add(truth.arm_error[rotor]);
    for (const Radians& arm : draws[i].scene.vehicle.o) csv.add(arm.value());
    csv.add(start / k_t).add(rise / curve.largest_fitted().value() / k_t);
    csv.add(merits.lost_plain ? "1" : "0").add(merits.lost_compensated ? "1" : "0");
    csv.add(merits.hover_z_plain).add(merits.hover_z_compensated).add(merits.hover_xy_plain);
    csv.add(merits.hover_xy_compensated).add(merits.forward_x).add(merits.forward_plain);
    csv.add(merits.forward_compensated).add(merits.square_speed_ratio);
    csv.end_row();
  }
  return std::move(csv).text();
}

std::string comparison_figure(const std::string& title, const Experiment& experiment,
                              const std::vector<TraceRow>& plain, const std::vector<TraceRow>& compensated) {
  std::string script = terminal(900, 900) + kFigureHead;
  const auto block = [&](const char* name, const std::vector<TraceRow>& trace) {
    script += std::string("$") + name + " << EOD\n";
    for (std::size_t i = 0; i < trace.size(); i += kFigureStride) {
      const TraceRow& row = trace[i];
      script += aligned(row.time, 2, 0) + " " + aligned(row.reference.z() - row.truth.z(), 5, 0);
      for (const std::size_t rotor : {0u, 2u}) {
        script += " " + aligned(row.on_ways ? 100 * row.arms[rotor] : to_degrees(Radians(row.arms[rotor])), 3, 0) +
                  " " + aligned(to_degrees(Radians(row.occlusions[rotor])), 3, 0) + " " +
                  aligned(to_degrees(Radians(row.occlusions_believed[rotor])), 3, 0) + " " +
                  aligned(to_rpm(RadPerSec(row.speeds[rotor])), 1, 0);
      }
      script += "\n";
    }
    script += "EOD\n";
  };
  block("plain", plain);
  block("compensated", compensated);
  const double total = static_cast<double>(experiment.leg_count) * leg_seconds(experiment.path);
  script += "unset key\nset lmargin 11\nset rmargin 2\nset xrange [0:" + shortest(total) +
            "]\nset multiplot layout 4,1 title '" + title + "'\n";
  for (std::size_t i = 1; i < experiment.leg_count; ++i) {
    const std::string at = shortest(static_cast<double>(i) * leg_seconds(experiment.path));
    script += "set arrow from " + at + ", graph 0 to " + at + ", graph 1 nohead lc rgb '#999999' dt 2\n";
  }
  const auto line = [](const char* block_name, int column, const char* colour, const char* dash, const char* name) {
    return std::string("$") + block_name + " using 1:" + std::to_string(column) + " with lines lc rgb '" + colour +
           "' dt " + dash + " title '" + name + "'";
  };
  constexpr const char *kPlain = "#D55E00", *kHelped = "#0072B2";
  script +=
      "set key outside top right horizontal samplen 2\nset ylabel 'below reference [m]'\nplot 0 lc rgb '#bbbbbb' "
      "notitle, " +
      line("plain", 2, kPlain, "1", "without compensation") + ", " + line("compensated", 2, kHelped, "1", "with") +
      "\n";
  const bool on_ways = !compensated.empty() && compensated.front().on_ways;
  script += std::string("set ylabel '") + (on_ways ? "way of the hub [%]" : "arm angle [deg]") + "'\nplot " +
            line("compensated", 3, "#333333", "1", "arm 1") + ", " + line("compensated", 7, "#333333", "2", "arm 3") +
            "\n";
  script += "set ylabel 'occlusion [deg]'\nplot " + line("compensated", 4, "#009E73", "1", "rotor 1, true") + ", " +
            line("compensated", 5, "#555555", "3", "believed") + ", " +
            line("compensated", 8, "#56B4E9", "1", "rotor 3, true") + ", " +
            line("compensated", 9, "#555555", "3", "believed") + "\n";
  script += "set xlabel 'time [s]'\nset ylabel 'speed [RPM]'\nplot " +
            line("plain", 6, kPlain, "1", "rotor 1 without") + ", " + line("compensated", 6, kHelped, "1", "with") +
            ", " + line("plain", 10, kPlain, "2", "rotor 3 without") + ", " +
            line("compensated", 10, kHelped, "2", "with") + "\n";
  return script + "unset multiplot\n";
}

std::string error_figure(const Experiment& experiment, const std::vector<TraceRow>& trace) {
  const double total = static_cast<double>(experiment.leg_count) * leg_seconds(experiment.path);
  std::string script = terminal(800, 600) + kFigureHead + "$error << EOD\n";
  double lowest = -0.05, highest = 0.05;
  for (std::size_t i = 0; i < trace.size(); i += kFigureStride) {
    const Eigen::Vector3d error = trace[i].reference - trace[i].estimate;
    lowest = std::min(lowest, error.minCoeff());
    highest = std::max(highest, error.maxCoeff());
    script += aligned(trace[i].time, 2, 0);
    for (const double axis : error) script += " " + aligned(axis, 5, 0);
    script += "\n";
  }
  script += "EOD\n" + leg_marks(experiment) + "unset key\nset lmargin 9\nset xrange [0:" + shortest(total) +
            "]\nset yrange [" + aligned(lowest - 0.02, 3, 0) + ":" + aligned(highest + 0.2 * (highest - lowest), 3, 0) +
            "]\nset ytics " + (highest - lowest < 0.6 ? "0.1" : "0.25") +
            "\nset mytics 2\nset multiplot layout 3,1 title '" + std::string(experiment.title) +
            "   (reference - estimate, above 0 in z is below; grey: averaged)'\n";
  const char* colours[] = {"#0072B2", "#009E73", "#D55E00"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string name(1, static_cast<char>('x' + axis));
    script += "set ylabel '" + name + " error [m]'\n";
    if (axis == 2) script += "set xlabel 'time [s]'\n";
    script += "plot 0 lc rgb '#bbbbbb', $error using 1:" + std::to_string(axis + 2) + " with lines lc rgb '" +
              colours[axis] + "'\n";
  }
  return script + "unset multiplot\n";
}

std::string draws_figure(const std::vector<Draw>& draws) {
  std::string hover, forward;
  for (const Draw& draw : draws) {
    const Merits merits = merits_of(draw.flights);
    if (merits.lost()) continue;
    hover += shortest(merits.hover_z_plain) + " " + shortest(std::fabs(merits.hover_z_compensated)) + "\n";
    forward += shortest(merits.forward_plain) + " " + shortest(merits.forward_compensated) + "\n";
  }
  const auto plot = [](const std::string& title, const std::string& block, const std::string& colour) {
    return "set title '" + title + "'\nplot [0:*] [0:*] x lc rgb '#bbbbbb' title 'no difference', $" + block +
           " with points pt 7 ps 0.35 lc rgb '" + colour + "' title 'draws', $paper_" + block +
           " with points pt 2 ps 1.2 lc rgb '#D55E00' title 'paper'\n";
  };
  return terminal(900, 520) + kFigureHead + "$hover << EOD\n" + hover + "EOD\n$forward << EOD\n" + forward +
         "EOD\n$paper_hover << EOD\n0.17 0.043\n0.1594 0.0106\nEOD\n"
         "$paper_forward << EOD\n0.2339 0.1210\n0.2134 0.1318\nEOD\n"
         "set multiplot layout 1,2\nset key outside bottom center horizontal samplen 1\nset bmargin 6.5\n"
         "set xlabel 'without compensation [m]'\nset ylabel 'with compensation [m]'\n" +
         plot("height error of hover in O", "hover", "#0072B2") +
         plot("distance in forward flight in O", "forward", "#009E73") + "unset multiplot\n";
}

}  // namespace kphi::flight
