#include "daq/hardware/sleep_inhibitor.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <system_error>

#include "daq/hardware/system_bus.hpp"

namespace kphi::daq {
namespace {

using namespace std::chrono_literals;

constexpr auto kAllAnswers = 1500ms;

/// Each asks for less than the one before. Many versions of logind judge every combination as they judge the lid
/// switch, and may grant "sleep" where they refuse "sleep:idle".
constexpr const char* kWhats[] = {"sleep:idle:handle-lid-switch", "sleep:idle", "sleep"};

std::string words(int error) { return std::generic_category().message(error); }

/// Returns the lock, or a negative errno and its cause.
int inhibit(SystemBus& bus, const char* what, SystemBus::SteadyTime end, std::string& cause) {
  const SystemBus::Answer answer =
      bus.call({"org.freedesktop.login1", "/org/freedesktop/login1", "org.freedesktop.login1.Manager"}, "Inhibit", end,
               "ssss", what, "kphi", "the motor of the test stand may turn", "block");
  cause = answer.cause;
  if (answer.error < 0) return answer.error;
  int lent = -1;
  int result = sd_bus_message_read(answer.message.get(), "h", &lent);
  if (result >= 0) {
    result = fcntl(lent, F_DUPFD_CLOEXEC, 0);
    if (result < 0) result = -errno;
  }
  if (result < 0) cause = words(-result);
  return result;
}

bool refused(int error) { return error == EACCES || error == EPERM || error == EINVAL; }

std::string line(const std::string& state, std::string cause, const std::string& first_move = {}) {
  std::replace(cause.begin(), cause.end(), '\n', ' ');
  return fmt::format(
      "this computer may go to sleep during the run: {} ({}); {}disable sleep by hand, e.g. with "
      "`systemctl mask sleep.target`",
      state, cause, first_move);
}

std::string line_without_lock(int error, const std::string& cause) {
  if (error == EHOSTUNREACH) return line("no logind on the system bus", cause);
  if (refused(error)) return line("logind refused", cause, "log in at this computer itself, or ");
  return line("no lock from logind", cause);
}

}  // namespace

SleepInhibitor::SleepInhibitor() noexcept {
  const auto end = std::chrono::steady_clock::now() + kAllAnswers;
  SystemBus bus;
  if (bus.error() != 0) {
    why_not_ = line("no connection to the system bus", words(bus.error()));
    return;
  }
  for (const char* what : kWhats) {
    std::string cause;
    const int answer = inhibit(bus, what, end, cause);
    if (answer >= 0) {
      lock_ = Descriptor(answer);
      why_not_.clear();
      return;
    }
    why_not_ = line_without_lock(-answer, cause);
    if (!refused(-answer)) return;
  }
}

}  // namespace kphi::daq
