// The verbs of the program, and what they have in common.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/json.hpp"

namespace kphi::commands {

using Json = nlohmann::ordered_json;

/// Adds a verb to the program. If the verb was given, parsing the command line runs it and sets `exit_code`.
using AddVerb = void(CLI::App& program, ExitCode& exit_code);
AddVerb add_init, add_list, add_pack, add_check, add_plan, add_sim, add_devices, add_spin, add_weigh, add_run,
    add_replay, add_info, add_verify, add_import, add_fit, add_report, add_compare, add_export, add_compensate, add_fly,
    add_completion;

/// In the order of `kphi --help`.
inline constexpr AddVerb* kVerbs[] = {add_init,       add_check,  add_plan,      add_sim,    add_devices, add_spin,
                                      add_weigh,      add_run,    add_replay,    add_list,   add_info,    add_verify,
                                      add_pack,       add_import, add_fit,       add_report, add_compare, add_export,
                                      add_compensate, add_fly,    add_completion};

/// A verb that calls `run` with its options, which live as long as the program. Its --help ends with `example`.
template <class Options>
std::pair<CLI::App&, Options&> add_verb(CLI::App& program, ExitCode& exit_code, const char* name, const char* what,
                                        const char* example, ExitCode (*run)(const Options&)) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = program.add_subcommand(name, what)->footer(example);
  command->callback([options, run, &exit_code] { exit_code = run(*options); });
  return {*command, *options};
}

/// Text below the options, before the example.
inline void add_notes(CLI::App& command, const std::string& notes) {
  command.footer(notes + "\n\n" + command.get_footer());
}

/// A required value that stands by itself; --help shows its `name` only.
template <class Value>
CLI::Option* add_argument(CLI::App& command, const char* name, Value& into, const std::string& what) {
  return command.add_option(name, into, what)->required()->type_name("");
}

/// An option whose value --help shows as `word`.
template <class Value>
CLI::Option* add_value(CLI::App& command, const char* name, const char* word, Value& into, const std::string& what) {
  return command.add_option(name, into, what)->type_name(word);
}

/// One of `names`, which --help does not list with the option; completion knows them.
inline CLI::Validator one_of(const std::vector<std::string>& names) {
  return CLI::IsMember(names).description("").name(fmt::format("{{{}}}", fmt::join(names, ",")));
}

/// Options that follow stand under this heading of --help; those before it are for every day.
inline void begin_group(CLI::App& command, const char* heading) { command.option_defaults()->group(heading); }

/// CLI11's checks of a path, without their words in --help.
inline const CLI::Validator kExistingFile = CLI::ExistingFile.description("");
inline const CLI::Validator kExistingFolder(
    [](std::string& path) {
      std::error_code none;
      const bool is_file = std::filesystem::exists(path, none) && !std::filesystem::is_directory(path, none);
      return is_file ? path + " is a file; name the campaign folder that it is in" : CLI::ExistingDirectory(path);
    },
    "");
inline const CLI::Validator kExistingPath = CLI::ExistingPath.description("");

inline void print_json(const Json& json, int indent = 2) {
  fmt::print("{}\n", json.dump(indent, ' ', false, Json::error_handler_t::replace));
}

}  // namespace kphi::commands
