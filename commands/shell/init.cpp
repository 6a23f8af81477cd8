// `kphi init`: a file to begin with, with a comment on each line.
#include <fmt/format.h>

#include <filesystem>
#include <optional>

#include "commands/commands.hpp"
#include "commands/inputs.hpp"
#include "commands/outputs.hpp"
#include "commands/shell/templates.hpp"

namespace kphi::commands {
namespace {

namespace fs = std::filesystem;

struct InitRequest {
  std::string kind;
  std::string out;
  bool simulated = false;
};

/// Where the schemas lie: installed, or beside the build in its sources. nullopt: neither.
std::optional<fs::path> schema_folder() {
  std::error_code none;
  const fs::path program = fs::read_symlink("/proc/self/exe", none).parent_path();
  for (const char* from : {"../share/kphi/profiles/schema", "../../profiles/schema"}) {
    const fs::path folder = (program / from).lexically_normal();
    if (fs::is_directory(folder, none)) return folder;
  }
  return std::nullopt;
}

/// The template named `stem`, with the schema's address of this computer.
std::string named(std::string text, const std::string& stem) {
  const auto line_of = [&](const std::string& begin) {
    const std::size_t at = text.rfind(begin, 0) == 0 ? 0 : text.find("\n" + begin) + 1;
    return std::pair(at, text.find('\n', at) - at);
  };
  const auto [name, name_length] = line_of("name:");
  text.replace(name, name_length, "name: " + stem);
  const std::string modeline = "# yaml-language-server: $schema=";
  const auto [schema, schema_length] = line_of(modeline);
  const std::string file = fs::path(text.substr(schema, schema_length).substr(modeline.size())).filename();
  const auto folder = schema_folder();
  text.replace(schema, schema_length, folder ? modeline + (*folder / file).string() : "# an editor's schema: " + file);
  return text;
}

void write_new(const std::string& path, const char* text) {
  std::error_code none;
  if (fs::exists(path, none)) throw ConfigurationError(path + ": exists; choose another name with --out, or remove it");
  write_output(path, named(text, fs::path(path).stem()));
  fmt::print("{}\n", path);
}

/// All that a first campaign needs, on the simulated bench.
ExitCode init_all() {
  for (const char* path : {"campaign.yaml", "bench.yaml"})
    if (fs::exists(path)) throw ConfigurationError(std::string(path) + ": exists; run `kphi init` in another folder");
  write_new("campaign.yaml", kCampaignTemplate);
  write_new("bench.yaml", kSimulatedBenchTemplate);
  fmt::print(stderr,
             "next, in two terminals:\n"
             "  kphi sim bench.yaml\n"
             "  kphi run campaign.yaml --bench bench.yaml --yes\n"
             "then `kphi fit` with the folder that it names. For a real bench: kphi init bench --out my_bench.yaml\n");
  return ExitCode::ok;
}

ExitCode init(const InitRequest& request) {
  if (request.simulated && request.kind != "bench") throw ConfigurationError("--simulated is for `kphi init bench`");
  if (request.kind.empty()) {
    if (!request.out.empty()) throw ConfigurationError("--out needs a kind: kphi init bench --out " + request.out);
    return init_all();
  }
  const std::string path = request.out.empty() ? request.kind + ".yaml" : request.out;
  if (request.kind == "campaign") {
    write_new(path, kCampaignTemplate);
    fmt::print(stderr, "next: change it, then kphi check {0}, then kphi run {0} --bench BENCH --dry-run\n", path);
  } else if (request.kind == "vehicle") {
    write_new(path, kVehicleTemplate);
    fmt::print(stderr, "next: change it, then kphi check {0}, then kphi fly --coefficients FILE --vehicle {0}\n", path);
  } else {
    write_new(path, request.simulated ? kSimulatedBenchTemplate : kBenchTemplate);
    fmt::print(stderr, "next: {}\n",
               request.simulated ? "kphi sim " + path
                                 : fmt::format("change it, then kphi check {0}, then kphi devices --bench {0}", path));
  }
  return ExitCode::ok;
}

}  // namespace

void add_init(CLI::App& program, ExitCode& exit_code) {
  const auto [command, request] = add_verb<InitRequest>(
      program, exit_code, "init", "write a commented campaign, bench or vehicle file to begin with",
      "kphi init\nkphi init bench --out my_bench.yaml", init);
  command.add_option("KIND", request.kind, "what to write (default: campaign.yaml and a simulated bench.yaml)")
      ->type_name("{campaign,bench,vehicle}")
      ->check(CLI::IsMember({"campaign", "bench", "vehicle"}).description(""));
  add_value(command, "--out", "FILE", request.out, "file to write (default: KIND.yaml); it must not exist");
  command.add_flag("--simulated", request.simulated, "a bench that `kphi sim` simulates");
}

}  // namespace kphi::commands
