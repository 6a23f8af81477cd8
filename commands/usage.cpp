#include "commands/usage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "profiles/schema.hpp"

namespace kphi::commands {
namespace {

bool is_option(const std::string& word) { return word.size() > 1 && word.front() == '-'; }

std::string hint(const std::string& word, const std::vector<std::string>& names) {
  const auto nearest = profiles::nearest_name(word, names);
  return nearest ? fmt::format("; did you mean {}?", *nearest) : "";
}

std::vector<std::string> options_of(const CLI::App& verb) {
  std::vector<std::string> names;
  for (const CLI::Option* option : verb.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

/// The first word that `verb` does not know.
std::string unexpected(const CLI::App& verb, const std::vector<std::string>& typed) {
  const std::vector<std::string> names = options_of(verb);
  for (const std::string& word : typed) {
    const std::string name = word.substr(0, word.find('='));
    if (name.rfind("--", 0) == 0 && name.size() > 2 && std::find(names.begin(), names.end(), name) == names.end())
      return fmt::format("unknown option \"{}\"{}", name, hint(name, names));
  }
  const std::vector<std::string> left = verb.remaining();
  return left.empty() ? "an argument too many" : fmt::format("unexpected argument \"{}\"", left.front());
}

std::string what_is_wrong(const CLI::App& verb, const CLI::ParseError& error, const std::vector<std::string>& typed) {
  const std::string said = error.what(), unknown = unexpected(verb, typed);
  // An unknown option also leaves its value over, or takes the place of one that is missing.
  const auto is = [&](CLI::ExitCodes code) { return error.get_exit_code() == static_cast<int>(code); };
  if (is(CLI::ExitCodes::ExtrasError) || unknown.rfind("unknown option", 0) == 0) return unknown;
  constexpr std::string_view kRequired = " is required";
  if (is(CLI::ExitCodes::RequiredError) && said.size() > kRequired.size())
    return said.substr(0, said.rfind(kRequired)) + " is missing";
  return said;
}

constexpr std::size_t kColumns = 80, kWords = 28;  // a line; where the words of an option begin

/// Characters, not bytes.
std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(
      std::ranges::count_if(text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

/// `words` after `begin`, which is `used` wide; further lines are indented.
std::string wrapped(std::string line, std::size_t used, const std::string& words, std::size_t indent,
                    std::size_t columns = kColumns) {
  bool is_first = true;
  for (std::size_t at = 0; at < words.size();) {
    const std::size_t end = std::min(words.find(' ', at), words.size());
    const std::string word = words.substr(at, end - at);
    at = end + 1;
    if (!is_first && used + 1 + width_of(word) > columns) {
      line += "\n" + std::string(indent, ' ');
      used = indent;
      is_first = true;
    }
    line += (is_first ? "" : " ") + word;
    used += width_of(word) + !is_first;
    is_first = false;
  }
  return line + "\n";
}

class NarrowHelp : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    return row("  " + make_option_name(option, is_positional) + make_option_opts(option), make_option_desc(option));
  }
  /// One blank line before a further group, not CLI11's two.
  std::string make_group(std::string group, bool is_positional,
                         std::vector<const CLI::Option*> options) const override {
    const bool is_first = is_positional || group == get_label("Options");
    return CLI::Formatter::make_group(std::move(group), is_positional, std::move(options)).substr(is_first ? 0 : 1);
  }
  std::string make_subcommand(const CLI::App* verb) const override {
    return row(verb->get_display_name(true), verb->get_description());
  }
  std::string make_description(const CLI::App* verb) const override {
    return wrapped("", 0, verb->get_description(), 0);
  }
  std::string make_footer(const CLI::App* verb) const override {
    std::istringstream lines(verb->get_footer());
    std::string text;
    for (std::string line; std::getline(lines, line);) text += footer_line(line);
    return text;
  }

 private:
  /// A command continues after a backslash, a row of a table under its second column.
  static std::string footer_line(const std::string& line) {
    constexpr std::size_t kContinued = 4;
    if (width_of(line) <= kColumns) return line + "\n";
    const bool is_command = line.starts_with("kphi ");
    const std::size_t begin = std::min(line.find_first_not_of(' '), line.size()), gap = line.find("  ", begin);
    const std::size_t column = gap == std::string::npos ? begin : line.find_first_not_of(' ', gap);
    const std::size_t indent = is_command ? kContinued : column;
    std::string text = wrapped(line.substr(0, column), width_of(line.substr(0, column)), line.substr(column), indent,
                               is_command ? kColumns - 2 : kColumns);  // two for the backslash
    for (std::size_t at = 0; is_command && (at = text.find('\n', at)) + 1 < text.size(); at += 3)
      text.insert(at, " \\");
    return text;
  }
  static std::string row(const std::string& name, const std::string& words) {
    const std::size_t width = width_of(name);
    const std::string gap = width + 2 > kWords ? "\n" + std::string(kWords, ' ') : std::string(kWords - width, ' ');
    return wrapped(name + gap, kWords, words, kWords);
  }
};

}  // namespace

std::shared_ptr<CLI::FormatterBase> narrow_help() { return std::make_shared<NarrowHelp>(); }

void require_finite_numbers(CLI::App& program) {
  for (CLI::Option* option : program.get_options()) {
    if (option->get_items_expected_max() == 0) continue;
    option->check([](const std::string& text) {
      char* end = nullptr;
      const double value = std::strtod(text.c_str(), &end);
      const bool is_number = !text.empty() && end == text.c_str() + text.size();
      return is_number && !std::isfinite(value) ? text + " is not a finite number" : std::string();
    });
  }
  for (CLI::App* verb : program.get_subcommands([](const CLI::App*) { return true; })) require_finite_numbers(*verb);
}

std::vector<std::string> understood(int argc, const char* const* argv) {
  std::vector<std::string> typed(argv + std::min(argc, 1), argv + argc);
  if (typed.empty()) return {"--help"};
  if (typed.front() == "-v" || typed.front() == "version") typed.front() = "--version";
  if (typed.front() != "help") return typed;
  typed.erase(typed.begin());
  typed.emplace_back("--help");
  return typed;
}

std::string explain(const CLI::App& program, const CLI::ParseError& error, const std::vector<std::string>& typed) {
  const auto verbs = program.get_subcommands();
  if (!verbs.empty()) {
    const std::string name = verbs.front()->get_name();
    return fmt::format("kphi {0}: {1}\n`kphi {0} --help` explains it\n", name,
                       what_is_wrong(*verbs.front(), error, typed));
  }
  const std::string last = "`kphi --help` lists the commands\n";
  if (typed.empty() || is_option(typed.front()))
    return fmt::format("kphi: {}\n{}", what_is_wrong(program, error, typed), last);
  std::vector<std::string> names;
  for (const CLI::App* verb : program.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(verb->get_name());
  return fmt::format("kphi: unknown command \"{}\"{}\n{}", typed.front(), hint(typed.front(), names), last);
}

}  // namespace kphi::commands
