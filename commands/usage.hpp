// What a person typed and did not mean: one line that says what is wrong, and where the help is.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

namespace kphi::commands {

/// The command line as `program` parses it: without the program's name, `help VERB` as `VERB --help`, nothing as
/// `--help`, `-v` as `--version`.
[[nodiscard]] std::vector<std::string> understood(int argc, const char* const* argv);

/// Help within 80 columns. Set it before verbs are added: they take it from the program.
[[nodiscard]] std::shared_ptr<CLI::FormatterBase> narrow_help();

/// No option or argument of `program` and its verbs takes a number that is not finite: NaN is within every range. A
/// file of such a name is ./nan.
void require_finite_numbers(CLI::App& program);

/// Two lines for a command line that `program` could not parse: "kphi run: unknown option \"--dryrun\"; did you mean
/// --dry-run?".
[[nodiscard]] std::string explain(const CLI::App& program, const CLI::ParseError& error,
                                  const std::vector<std::string>& typed);

}  // namespace kphi::commands
