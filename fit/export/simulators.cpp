// agilicious and Gazebo: one constant for each motor.
#include <fmt/format.h>

#include "base/number.hpp"
#include "fit/export/facts.hpp"
#include "fit/report/html.hpp"

namespace kphi::fit {
namespace {

/// Two hyphens end an XML comment.
std::string xml_comment_safe(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at)) text[at + 1] = ' ';
  if (!text.empty() && text.back() == '-') text += ' ';
  return html_escaped(text);
}

}  // namespace

/// T = c2 ω² + c1 ω + c0, ω in rad/s: `thrust_map: [c2, c1, c0]` of a quadrotor file.
Export to_agilicious(const compensation::Coefficients& file, const ExportOptions& options) {
  Export result;
  result.text = comment(file, "# ") +
                fmt::format("# phi = {:g} deg; c2 N/(rad/s)^2, c1 N/(rad/s), c0 N\nthrust_map: [{}, 0.0, 0.0]\n",
                            options.phi_deg, yaml_number(coefficient_at(file, options.phi_deg)));
  if (options.speed_max_rpm || file.fastest_speed)
    result.text += fmt::format("motor_omega_max: {}  # rad/s\n", yaml_number(speed_max_of(file, options)));
  const auto kappa = torque_per_thrust(file, options.phi_deg);
  if (kappa)
    result.text += fmt::format("kappa: {}  # torque per thrust, {}\n", yaml_number(kappa->value), words_of(*kappa));
  if (file.slowest_speed)
    result.text +=
        fmt::format("motor_omega_min: {}  # rad/s, the slowest measured\n", yaml_number(file.slowest_speed->value()));
  result.lost = {no_phi(file, "thrust_map", options.phi_deg),
                 "uncertainties, air density: the file has no keys for them; see its comments"};
  if (!kappa) result.lost.emplace_back(kNoTorque);
  say_trend(file, result);
  return result;
}

/// SDF for gz-sim's MulticopterMotorModel: motorConstant in N/(rad/s)², momentConstant (torque per thrust) in m,
/// maxRotVelocity in rad/s. RotorS' motorConstant and momentConstant are the same numbers.
Export to_gazebo(const compensation::Coefficients& file, const ExportOptions& options) {
  require_turns(options);
  const double k = coefficient_at(file, options.phi_deg);
  const auto moment = torque_per_thrust(file, options.phi_deg);
  Export result;
  result.text = "<?xml version=\"1.0\"?>\n<sdf version=\"1.9\">\n";
  for (const std::string& line : provenance_lines(file)) result.text += "  <!-- " + xml_comment_safe(line) + " -->\n";
  result.text += fmt::format("  <!-- phi = {:g} deg; motorConstant in N/(rad/s)^2, maxRotVelocity in rad/s -->\n",
                             options.phi_deg);
  if (moment) result.text += fmt::format("  <!-- momentConstant, torque per thrust: {} -->\n", words_of(*moment));
  result.text += fmt::format("  <model name=\"{}\">\n", html_escaped(one_line(file.propeller.id)));
  for (int motor = 0; motor < options.motors; ++motor) {
    result.text += fmt::format(
        "    <plugin filename=\"gz-sim-multicopter-motor-model-system\" "
        "name=\"gz::sim::systems::MulticopterMotorModel\">\n"
        "      <jointName>rotor_{0}_joint</jointName>\n      <linkName>rotor_{0}</linkName>\n"
        "      <motorNumber>{0}</motorNumber>\n      <motorType>velocity</motorType>\n"
        "      <motorConstant>{1}</motorConstant>\n      <maxRotVelocity>{2}</maxRotVelocity>\n",
        motor, shortest(k), shortest(speed_max_of(file, options)));
    if (moment) result.text += fmt::format("      <momentConstant>{}</momentConstant>\n", shortest(moment->value));
    if (!options.turns.empty())
      result.text += fmt::format("      <turningDirection>{}</turningDirection>\n",
                                 options.turns[static_cast<std::size_t>(motor)] == Turn::clockwise ? "cw" : "ccw");
    result.text += "    </plugin>\n";
  }
  result.text += "  </model>\n</sdf>\n";
  result.lost = {
      no_phi(file, "MulticopterMotorModel", options.phi_deg),
      "time constants: not in the coefficient file; timeConstantUp and timeConstantDown keep the plugin's defaults",
      "names of joints and links: rotor_N; replace them with the model's"};
  if (!moment) result.lost.emplace_back(kNoTorque);
  if (options.turns.empty())
    result.lost.emplace_back("turning directions: the plugin's default; name them with --turns ccw,ccw,cw,cw");
  say_trend(file, result);
  return result;
}

}  // namespace kphi::fit
