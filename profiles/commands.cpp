#include "profiles/commands.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "compensation/file/coefficient_file.hpp"
#include "profiles/check.hpp"

namespace kphi::profiles {
namespace {

struct CheckOptions {
  std::vector<std::string> paths;
  bool json = false;
};

std::string judge_coefficients(const std::string& path) {
  const compensation::Coefficients c = compensation::load_coefficients(path);
  return fmt::format(
      "  propeller  {} ({})\n"
      "  K_T        {:.6g} N/(rad/s)^2 = {:.6g} N/RPM^2\n"
      "  line       k = {:.6g} {:+.6g} * phi/rad N/(rad/s)^2{}\n"
      "  valid      {:g} to {:g} degrees\n",
      c.propeller.id, c.propeller.name, c.thrust_coefficient.value(), to_newtons_per_rpm2(c.thrust_coefficient),
      c.line.intercept.value(), c.line.slope_per_rad, c.line.anchored ? ", anchored at K_T" : "",
      to_degrees(c.smallest_occlusion), to_degrees(c.largest_occlusion));
}

void print(const CheckedFile& file, bool json) {
  if (json) {
    fmt::print("{}\n", file.report.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    return;
  }
  if (file.ok()) fmt::print("{}: {} in order\n{}", file.path, file.kind, file.summary);
  for (const std::string& error : file.errors) fmt::print(stderr, "{}\n", error);
}

}  // namespace

void add_check(CLI::App& program, int& exit_code) {
  auto* command = program.add_subcommand("check", "check campaign, bench, vehicle and coefficient files");
  auto options = std::make_shared<CheckOptions>();
  command->add_option("FILE", options->paths, "Files; campaigns are also held against the benches among them")
      ->required();
  command->add_flag("--json", options->json, "One JSON object per file, one per line");
  command->callback([options, &exit_code] {
    exit_code = 0;
    for (const CheckedFile& file : check_files(options->paths, judge_coefficients)) {
      print(file, options->json);
      if (!file.ok()) exit_code = 2;
    }
  });
}

}  // namespace kphi::profiles
