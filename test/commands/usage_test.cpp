#include "commands/usage.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <sstream>

#include "commands/commands.hpp"

namespace kphi::commands::usage_test {

/// What the program says to these words, none of which starts a verb.
std::string refusal(const std::vector<std::string>& words) {
  CLI::App program;
  ExitCode exit_code = ExitCode::ok;
  for (AddVerb* add : kVerbs) add(program, exit_code);
  program.require_subcommand(1);
  require_finite_numbers(program);
  try {
    program.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::ParseError& error) {
    return error.what();
  }
  return "";
}

TEST(Numbers, OfTheCommandLineAreFiniteInEveryOptionOfEveryVerb) {
  CLI::App program;
  ExitCode exit_code = ExitCode::ok;
  for (AddVerb* add : kVerbs) add(program, exit_code);
  int options = 0;
  for (const CLI::App* verb : program.get_subcommands([](const CLI::App*) { return true; })) {
    for (const CLI::Option* option : verb->get_options()) {
      if (option->get_items_expected_max() == 0 || option->get_lnames().empty()) continue;
      for (const char* number : {"nan", "-NaN", "inf", "-Infinity", "1e999"}) {
        const std::string words = verb->get_name() + " --" + option->get_lnames().front() + "=" + number;
        EXPECT_NE(refusal({verb->get_name(), "--" + option->get_lnames().front() + "=" + number}), "") << words;
      }
      ++options;
    }
  }
  EXPECT_GT(options, 100);
}

TEST(Numbers, ThatAreNotFiniteAreNamed) {
  EXPECT_THAT(refusal({"spin", "--slew", "nan"}), testing::HasSubstr("--slew: nan is not a finite number"));
  EXPECT_THAT(refusal({"run", "nan"}), testing::HasSubstr("nan is not a finite number"));
  EXPECT_THAT(refusal({"spin", "--slew", "1e3"}), testing::Not(testing::HasSubstr("finite")));
}

TEST(Help, FitsEightyColumns) {
  CLI::App program("kphi", "kphi");
  program.formatter(narrow_help());
  ExitCode exit_code = ExitCode::ok;
  for (AddVerb* add : kVerbs) add(program, exit_code);
  for (const CLI::App* verb : program.get_subcommands([](const CLI::App*) { return true; })) {
    std::istringstream help(verb->help());
    for (std::string line; std::getline(help, line);) {
      const auto width = std::ranges::count_if(line, [](unsigned char c) { return (c & 0xC0) != 0x80; });
      EXPECT_LE(width, 80) << verb->get_name() << ": " << line;
    }
  }
}

TEST(Help, StartsWithWhatIsForEveryDayAndHasNoMoreThanTenOptionsUnderAHeading) {
  CLI::App program("kphi", "kphi");
  program.formatter(narrow_help());
  ExitCode exit_code = ExitCode::ok;
  for (AddVerb* add : kVerbs) add(program, exit_code);
  for (const CLI::App* verb : program.get_subcommands([](const CLI::App*) { return true; })) {
    std::map<std::string, int> options;  // by heading
    for (const CLI::Option* option : verb->get_options())
      if (!option->get_lnames().empty()) EXPECT_LE(++options[option->get_group()], 10) << verb->get_name();
    const std::string help = verb->help();
    EXPECT_LE(options.size() > 1 ? help.find("\nOptions:\n") : 0, help.find("\nDevelopers")) << verb->get_name();
    EXPECT_EQ(help.find("\n\n\n"), std::string::npos) << help;
    for (const auto& [heading, count] : options)
      EXPECT_NE(help.find("\n" + heading + ":\n"), std::string::npos) << verb->get_name() << ": " << heading;
  }
  const std::string fit = program.get_subcommand("fit")->help();
  EXPECT_LT(fit.find("--vehicle"), fit.find("\nEstimators:\n"));
  EXPECT_GT(fit.find("--estimator"), fit.find("\nEstimators:\n"));
}

}  // namespace kphi::commands::usage_test
