// SDF for gz-sim's MulticopterMotorModel: motorConstant in N/(rad/s)², maxRotVelocity in rad/s. RotorS' motorConstant
// is the same number.
#include <fmt/format.h>

#include "fit/export/wording.hpp"
#include "fit/html.hpp"
#include "results/number.hpp"

namespace kphi::fit {
namespace {

/// Two hyphens end an XML comment.
std::string comment_safe(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at)) text[at + 1] = ' ';
  if (!text.empty() && text.back() == '-') text += ' ';
  return html_escaped(text);
}

}  // namespace

Export to_gazebo(const compensation::Coefficients& file, const ExportOptions& options) {
  const double k = coefficient_at(file, options.phi_deg);
  Export result;
  result.text = "<?xml version=\"1.0\"?>\n<sdf version=\"1.9\">\n";
  for (const std::string& line : provenance_lines(file)) result.text += "  <!-- " + comment_safe(line) + " -->\n";
  result.text += fmt::format("  <!-- phi = {:g} deg; motorConstant in N/(rad/s)^2, maxRotVelocity in rad/s -->\n",
                             options.phi_deg);
  result.text += fmt::format("  <model name=\"{}\">\n", html_escaped(one_line(file.propeller.id)));
  for (int motor = 0; motor < options.motors; ++motor) {
    result.text += fmt::format(
        "    <plugin filename=\"gz-sim-multicopter-motor-model-system\" "
        "name=\"gz::sim::systems::MulticopterMotorModel\">\n"
        "      <jointName>rotor_{0}_joint</jointName>\n      <linkName>rotor_{0}</linkName>\n"
        "      <motorNumber>{0}</motorNumber>\n      <motorType>velocity</motorType>\n"
        "      <motorConstant>{1}</motorConstant>\n      <maxRotVelocity>{2}</maxRotVelocity>\n    </plugin>\n",
        motor, results::shortest(k), results::shortest(speed_max_of(file, options)));
  }
  result.text += "  </model>\n</sdf>\n";
  result.lost = {
      no_phi("MulticopterMotorModel", options.phi_deg),
      "torque and time constants: the coefficient file does not hold them; momentConstant, timeConstantUp and "
      "timeConstantDown stay at the plugin's defaults",
      "names of joints and links, turning directions: rotor_N and the defaults stand in; make them the model's"};
  return result;
}

}  // namespace kphi::fit
