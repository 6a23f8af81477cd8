// kphi: the table of contents. Each folder owns its commands; what goes wrong becomes one line and an exit code here.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <functional>
#include <iostream>
#include <vector>

#include "compensation/commands.hpp"
#include "compensation/flight/commands.hpp"
#include "daq/commands.hpp"
#include "daq/console.hpp"
#include "daq/devices_commands.hpp"
#include "daq/interlock.hpp"
#include "daq/interrupt.hpp"
#include "daq/replay_commands.hpp"
#include "drivers/device_error.hpp"
#include "drivers/sim/commands.hpp"
#include "fit/commands.hpp"
#include "fit/import_commands.hpp"
#include "fit/report_commands.hpp"
#include "fit/result_commands.hpp"
#include "profiles/commands.hpp"
#include "profiles/configuration_error.hpp"
#include "results/commands.hpp"
#include "results/record_error.hpp"
#include "results/version.hpp"

namespace {

enum ExitCode {
  kOk = 0,
  kFailure = 1,
  kUsage = 2,
  kNoDevice = 3,
  kSafetyStop = 4,
  kDataRejected = 5,
  kInterrupted = 130
};

constexpr const char* kFooter =
    "Exit codes: 0 ok, 1 failure, 2 usage or configuration, 3 device not found, 4 safety stop,\n"
    "            5 data rejected, 130 interrupted after a controlled spin-down.\n"
    "Data goes to stdout, words to stderr. Data that cannot be written (closed pipe, full disk) is a failure (1);\n"
    "a run continues, and its exit code tells how the run went. NO_COLOR is honoured.\n\n"
    "Without hardware:  kphi sim profiles/bench_simulated.yaml &\n"
    "                   kphi run profiles/icra2021_5in_3blade.yaml --bench profiles/bench_simulated.yaml --yes\n"
    "                   kphi fit results/<the folder it named>\n"
    "                   kphi fly --coefficients results/<the folder>/coefficients.yaml \\\n"
    "                            --vehicle profiles/foldable_drone.yaml";

/// A write that fails tells as much as these signals, and leaves the program alive to let the motor go.
void ignore_signals_of_writes() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

/// A file that is opened later must not get the number of a closed standard stream: messages would go into the file.
/// What takes the place can be neither read nor written.
void fill_closed_streams() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(descriptor, F_GETFD) < 0) (void)::open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

/// After what a run has said; all other verbs write directly, however long that takes.
void tell(const std::string& words) {
  if (kphi::daq::console().is_used()) return kphi::daq::put(stderr, words);
  (void)std::fputs(words.c_str(), stderr);
}

int complain(const std::exception& error, int exit_code) {
  tell(fmt::format("kphi: {}\n", error.what()));
  return exit_code;
}

int tell(const kphi::daq::RunStopped& stop, const char* headline, int exit_code) {
  tell(stop.words().text(headline));
  return exit_code;
}

/// CLI11 says only "A subcommand is required" of a misspelt one.
std::string nearest_command(const CLI::App& program, const std::string& word) {
  for (const CLI::App* command : program.get_subcommands({})) {
    const std::string& name = command->get_name();
    if (name.starts_with(word.substr(0, 3)) ||
        name.ends_with(word.substr(word.size() - std::min<std::size_t>(3, word.size())))) {
      return name;
    }
  }
  return {};
}

int usage_error(const CLI::App& program, const CLI::ParseError& error, int argc, char** argv) {
  if (error.get_exit_code() == 0) return program.exit(error);  // --help, --version
  tell(fmt::format("kphi: {}\n", error.what()));
  if (argc > 1 && argv[1][0] != '-' && program.get_subcommands().empty()) {
    const std::string nearest = nearest_command(program, argv[1]);
    tell(
        fmt::format("\"{}\" is no command{}\n", argv[1], nearest.empty() ? "" : "; did you mean \"" + nearest + "\"?"));
  }
  tell("kphi --help lists the commands\n");
  return kUsage;
}

/// Gives the words of a run a second to leave. Data that could not be written is a failure, even if only the last flush
/// finds it.
int end(int exit_code) {
  errno = 0;
  const bool is_written = std::cout.flush() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if (!is_written && exit_code == kOk) {
    tell(fmt::format("kphi: standard output could not be written{}{}\n", errno != 0 ? ": " : "",
                     errno != 0 ? std::strerror(errno) : ""));
    exit_code = kFailure;
  }
  (void)kphi::daq::console().finish(kphi::daq::Console::kGiveUp);
  return exit_code;
}

int run(int argc, char** argv) {
  CLI::App program("kphi: propeller test stand to k(φ) line to flight", "kphi");
  program.footer(kFooter);
  program.set_version_flag("--version", std::string("kphi ") + kphi::kVersion);
  program.require_subcommand(1);
  int exit_code = kOk;

  kphi::profiles::add_check(program, exit_code);
  kphi::sim::add_sim(program, exit_code);
  kphi::daq::add_devices(program, exit_code);
  kphi::daq::add_run(program, exit_code);
  kphi::daq::add_replay(program, exit_code);
  kphi::results::add_info(program, exit_code);
  kphi::results::add_verify(program, exit_code);
  kphi::fit::add_import(program, exit_code);
  kphi::fit::add_fit(program, exit_code);
  kphi::fit::add_report(program, exit_code);
  kphi::fit::add_compare(program, exit_code);
  kphi::fit::add_export(program, exit_code);
  kphi::compensation::add_compensate(program, exit_code);
  kphi::flight::add_fly(program, exit_code);

  try {
    program.parse(argc, argv);
    return exit_code;
  } catch (const CLI::ParseError& error) {
    return usage_error(program, error, argc, argv);
  } catch (const kphi::ConfigurationError& error) {
    return complain(error, kUsage);
  } catch (const kphi::DeviceError& error) {
    return complain(error, kNoDevice);
  } catch (const kphi::daq::SafetyStop& stop) {
    return tell(stop, "SAFETY STOP", kSafetyStop);
  } catch (const kphi::daq::Interrupted& stop) {
    return tell(stop, "STOPPED", kInterrupted);
  } catch (const kphi::results::DataRejected& error) {
    return complain(error, kDataRejected);
  } catch (const std::exception& error) {
    return complain(error, kFailure);
  }
}

}  // namespace

int main(int argc, char** argv) {
  ignore_signals_of_writes();
  fill_closed_streams();
  return end(run(argc, argv));
}
