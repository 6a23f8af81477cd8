// `kphi completion`: what a shell needs to complete the command line, made from the command line itself.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

#include "commands/commands.hpp"

namespace kphi::commands {
namespace {

struct OptionWords {
  std::string name;   ///< "--bench"
  std::string value;  ///< what --help calls its value; empty: a flag
  std::vector<std::string> choices;
  std::string what;
};

struct VerbWords {
  std::string name, what;
  std::vector<OptionWords> options;
  std::vector<std::string> choices;  ///< of its argument; empty: a file
};

/// "a" and "b" of "{a,b}", as CLI11 shows what a value may be.
std::vector<std::string> choices_in(const std::string& type) {
  std::vector<std::string> choices;
  const std::size_t begin = type.find('{'), end = type.find('}');
  if (begin == std::string::npos || end == std::string::npos) return choices;
  std::string inside = type.substr(begin + 1, end - begin - 1);
  for (std::size_t comma; (comma = inside.find(',')) != std::string::npos; inside.erase(0, comma + 1))
    choices.push_back(inside.substr(0, comma));
  choices.push_back(inside);
  return choices;
}

/// What its value may be, as --help shows it, or as one_of() keeps it.
std::vector<std::string> choices_of(CLI::Option& option) {
  if (auto shown = choices_in(option.get_type_name()); !shown.empty()) return shown;
  try {
    return choices_in(option.get_validator(0)->get_name());
  } catch (const CLI::OptionNotFound&) {  // any value
    return {};
  }
}

std::vector<VerbWords> verbs_of(CLI::App& program) {
  std::vector<VerbWords> all;
  for (CLI::App* verb : program.get_subcommands([](CLI::App*) { return true; })) {
    VerbWords words{verb->get_name(), verb->get_description(), {}, {}};
    for (CLI::Option* option : verb->get_options()) {
      const std::string value = option->get_items_expected_max() > 0 ? option->get_type_name() : "";
      if (option->get_lnames().empty()) {
        words.choices = choices_of(*option);
        continue;
      }
      words.options.push_back(
          {"--" + option->get_lnames().front(), value, choices_of(*option), option->get_description()});
    }
    all.push_back(std::move(words));
  }
  return all;
}

std::vector<std::string> names_of(const std::vector<VerbWords>& verbs) {
  std::vector<std::string> names;
  for (const VerbWords& verb : verbs) names.push_back(verb.name);
  return names;
}

/// In single quotes of a shell, without what zsh takes for more.
std::string quoted(std::string text) {
  const auto instead = [&](char from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) text.replace(at, 1, to);
  };
  instead('\n', " ");
  instead('[', "(");
  instead(']', ")");
  instead('\'', "’");
  instead(':', " ");
  return text;
}

std::string for_bash(const std::vector<VerbWords>& verbs) {
  std::string cases;
  for (const VerbWords& verb : verbs) {
    std::vector<std::string> options;
    std::string values;
    for (const OptionWords& option : verb.options) {
      options.push_back(option.name);
      if (!option.choices.empty())
        values += fmt::format(" {}) words=\"{}\" ;;", option.name, fmt::join(option.choices, " "));
      else if (!option.value.empty())
        values += fmt::format(" {}) files=1 ;;", option.name);
    }
    cases += fmt::format("    {}) options=\"{}\"; case $before in{} *) words=\"{}\" ;; esac ;;\n", verb.name,
                         fmt::join(options, " "), values, fmt::join(verb.choices, " "));
  }
  return fmt::format(
      "# bash completion of kphi, by `kphi completion bash`\n"
      "_kphi() {{\n"
      "  local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} verb= options= words= files= i\n"
      "  for ((i = 1; i < COMP_CWORD; i++)); do\n"
      "    [[ ${{COMP_WORDS[i]}} == -* ]] || {{ verb=${{COMP_WORDS[i]}}; break; }}\n"
      "  done\n"
      "  case $verb in\n"
      "    \"\"|help) words=\"{} help\"; options=\"--help --version\" ;;\n"
      "{}"
      "  esac\n"
      "  if [[ $word == -* && -z $files ]]; then words=$options; fi\n"
      "  if [[ -n $words ]]; then COMPREPLY=($(compgen -W \"$words\" -- \"$word\")); else COMPREPLY=($(compgen -f -- "
      "\"$word\")); fi\n"
      "}}\n"
      "complete -o filenames -o bashdefault -F _kphi kphi\n",
      fmt::join(names_of(verbs), " "), cases);
}

std::string for_zsh(const std::vector<VerbWords>& verbs) {
  std::string list, cases;
  for (const VerbWords& verb : verbs) {
    list += fmt::format("    '{}:{}'\n", verb.name, quoted(verb.what));
    cases += fmt::format("    {}) _arguments", verb.name);
    for (const OptionWords& option : verb.options) {
      const std::string value = option.value.empty()     ? ""
                                : option.choices.empty() ? ":" + quoted(option.value) + ":_files"
                                                         : fmt::format(":value:({})", fmt::join(option.choices, " "));
      cases += fmt::format(" \\\n        '*{}[{}]{}'", option.name, quoted(option.what), value);
    }
    cases += fmt::format(" \\\n        '*:argument:{}' ;;\n",
                         verb.choices.empty() ? "_files" : fmt::format("({})", fmt::join(verb.choices, " ")));
  }
  return fmt::format(
      "#compdef kphi\n"
      "# zsh completion of kphi, by `kphi completion zsh`\n"
      "local -a verbs=(\n{})\n"
      "if (( CURRENT == 2 )); then\n"
      "  _describe command verbs\n"
      "else\n"
      "  shift words; (( CURRENT-- ))\n"
      "  case $words[1] in\n{}"
      "  esac\n"
      "fi\n",
      list, cases);
}

std::string for_fish(const std::vector<VerbWords>& verbs) {
  std::string text = "# fish completion of kphi, by `kphi completion fish`\n";
  for (const VerbWords& verb : verbs) {
    text += fmt::format("complete -c kphi -n __fish_use_subcommand -f -a {} -d '{}'\n", verb.name, quoted(verb.what));
    for (const OptionWords& option : verb.options) {
      const std::string value = option.value.empty()     ? ""
                                : option.choices.empty() ? " -r"
                                                         : fmt::format(" -x -a '{}'", fmt::join(option.choices, " "));
      text += fmt::format("complete -c kphi -n '__fish_seen_subcommand_from {}' -l {}{} -d '{}'\n", verb.name,
                          option.name.substr(2), value, quoted(option.what));
    }
    if (!verb.choices.empty())
      text += fmt::format("complete -c kphi -n '__fish_seen_subcommand_from {}' -f -a '{}'\n", verb.name,
                          fmt::join(verb.choices, " "));
  }
  return text;
}

}  // namespace

void add_completion(CLI::App& program, ExitCode& exit_code) {
  const auto shell = std::make_shared<std::string>();
  CLI::App* command = program.add_subcommand("completion", "print what bash, zsh or fish needs to complete kphi");
  add_argument(*command, "SHELL", *shell, "the shell")
      ->type_name("{bash,fish,zsh}")
      ->check(CLI::IsMember({"bash", "fish", "zsh"}).description(""));
  command->footer("source <(kphi completion bash)");
  command->callback([&program, &exit_code, shell] {
    const std::vector<VerbWords> verbs = verbs_of(program);
    fmt::print("{}", *shell == "bash" ? for_bash(verbs) : *shell == "zsh" ? for_zsh(verbs) : for_fish(verbs));
    exit_code = ExitCode::ok;
  });
}

}  // namespace kphi::commands
