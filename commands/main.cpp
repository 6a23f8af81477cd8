// kphi: the table of contents. Every error becomes one line and an exit code here.
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iostream>
#include <vector>

#include "base/text.hpp"
#include "commands/commands.hpp"
#include "commands/usage.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "daq/guard/run_stopped.hpp"
#include "daq/run/console.hpp"
#include "examples/second_bench/offer.hpp"
#include "results/version.hpp"

namespace {

using kphi::ExitCode;

constexpr const char* kFooter =
    "Exit codes: 0 ok, 1 failure, 2 usage or configuration, 3 device not found,\n"
    "            4 safety stop, 5 data rejected, 6 bench or folder in use,\n"
    "            130 interrupted after a controlled spin-down.\n"
    "Data goes to stdout, messages to stderr. Data that cannot be written (closed\n"
    "pipe, full disk) is a failure (1); a run continues, and its exit code says how\n"
    "the run ended. NO_COLOR is honoured.\n\n"
    "Without hardware:  kphi init\n"
    "                   kphi sim bench.yaml &\n"
    "                   kphi run campaign.yaml --bench bench.yaml --yes\n"
    "                   kphi fit results/<the folder it printed>\n"
    "                   kphi init vehicle\n"
    "                   kphi fly --vehicle vehicle.yaml \\\n"
    "                            --coefficients results/<folder>/coefficients.yaml";

/// A file that is opened later must not get the number of a closed standard stream: messages would go into the file.
/// The replacement can be neither read nor written.
void fill_closed_streams() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(descriptor, F_GETFD) < 0) (void)::open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

/// After the messages of a run; all other verbs write directly, however long that takes.
void print_message(const std::string& words) {
  if (kphi::daq::console().is_used()) return kphi::daq::put(stderr, words);
  (void)std::fputs(words.c_str(), stderr);
}

ExitCode complain(const std::exception& error, ExitCode exit_code) {
  constexpr std::size_t kLongest = 8192;  // whatever a file holds
  const std::string_view words = error.what();
  print_message(fmt::format("kphi: {}{}\n", kphi::printable(words.substr(0, kLongest), kphi::LineEnds::keep),
                            words.size() > kLongest ? "…" : ""));
  return exit_code;
}

ExitCode complain(const kphi::daq::RunStopped& stop) {
  using kphi::daq::SignalWatch;
  const bool suspends = SignalWatch::is_suspension_asked();
  print_message(stop.words().text(stop.exit_code() == ExitCode::safety_stop ? "SAFETY STOP" : "STOPPED") +
                (suspends ? "  Ctrl-Z: everything is closed; fg only ends kphi\n" : ""));
  if (suspends) {
    (void)kphi::daq::console().finish(kphi::daq::Console::kGiveUp);
    SignalWatch::suspend();
  }
  return stop.exit_code();
}

ExitCode usage_error(const CLI::App& program, const CLI::ParseError& error, const std::vector<std::string>& typed) {
  if (error.get_exit_code() == 0) {  // --help, --version
    program.exit(error);
    return ExitCode::ok;
  }
  print_message(kphi::commands::explain(program, error, typed));
  return ExitCode::usage;
}

/// Gives the messages of a run a second to leave. Data that could not be written is a failure, even if only the last
/// flush finds it.
int end(ExitCode exit_code) {
  errno = 0;
  const bool is_written = std::cout.flush() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if (!is_written && exit_code == ExitCode::ok) {
    print_message(fmt::format("kphi: cannot write to standard output{}{}\n", errno != 0 ? ": " : "",
                              errno != 0 ? std::strerror(errno) : ""));
    exit_code = ExitCode::failure;
  }
  (void)kphi::daq::console().finish(kphi::daq::Console::kGiveUp);
  return static_cast<int>(exit_code);
}

ExitCode run(int argc, char** argv) {
  CLI::App program("kphi: propeller test stand to k(φ) to flight", "kphi");
  program.formatter(kphi::commands::narrow_help());
  program.set_help_flag("-h,--help", "print this help and exit");
  program.set_version_flag("--version", std::string("kphi ") + kphi::kVersion);
  program.require_subcommand(1);
  ExitCode exit_code = ExitCode::ok;
  for (kphi::commands::AddVerb* add : kphi::commands::kVerbs) add(program, exit_code);
  kphi::commands::require_finite_numbers(program);
  program.footer(kFooter);  // a verb added later would repeat it

  const std::vector<std::string> typed = kphi::commands::understood(argc, argv);
  try {
    program.parse(std::vector<std::string>(typed.rbegin(), typed.rend()));  // CLI11 takes words from the end
    return exit_code;
  } catch (const CLI::ParseError& error) {
    return usage_error(program, error, typed);
  } catch (const kphi::daq::RunStopped& stop) {
    return complain(stop);
  } catch (const kphi::Error& error) {
    return complain(error, error.exit_code());
  } catch (const kphi::compensation::CoefficientError& error) {
    return complain(error, ExitCode::usage);
  } catch (const std::exception& error) {
    return complain(error, ExitCode::failure);
  }
}

}  // namespace

int main(int argc, char** argv) {
  // A failed write says as much as these signals, and leaves the program alive to coast the motor.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  fill_closed_streams();
  kphi::second_bench::offer_drivers();
  return end(run(argc, argv));
}
