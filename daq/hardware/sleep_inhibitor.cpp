#include "daq/hardware/sleep_inhibitor.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <systemd/sd-bus.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <memory>
#include <system_error>

namespace kphi::daq {
namespace {

using namespace std::chrono_literals;
using SteadyTime = std::chrono::steady_clock::time_point;

constexpr auto kOneAnswer = 500ms;
constexpr auto kAllAnswers = 1500ms;

/// Each asks for less than the one before. Many versions of logind judge every combination as they judge the lid
/// switch, and may grant "sleep" where they refuse "sleep:idle".
constexpr const char* kWhats[] = {"sleep:idle:handle-lid-switch", "sleep:idle", "sleep"};

/// Does not flush: that would wait for a peer that does not read.
using Bus = std::unique_ptr<sd_bus, decltype([](sd_bus* bus) { sd_bus_close_unref(bus); })>;
using Message = std::unique_ptr<sd_bus_message, decltype([](sd_bus_message* one) { sd_bus_message_unref(one); })>;

SteadyTime now() { return std::chrono::steady_clock::now(); }

/// At least 1: sd-bus takes 0 for its own limit of 25 s.
std::uint64_t microseconds_until(SteadyTime end) {
  const auto left = std::chrono::duration_cast<std::chrono::microseconds>(end - now()).count();
  return static_cast<std::uint64_t>(std::max<std::int64_t>(left, 1));
}

/// Returns when the bus has greeted back: 0, or an errno. sd_bus_call would wait 90 s for a bus that does not.
int connect(Bus& bus) {
  sd_bus* opened = nullptr;
  if (const int error = sd_bus_open_system(&opened); error < 0) return -error;
  bus.reset(opened);
  const SteadyTime end = now() + kOneAnswer;
  while (sd_bus_is_ready(opened) <= 0) {
    if (now() >= end) return ETIMEDOUT;
    int progress = sd_bus_process(opened, nullptr);
    if (progress == 0) progress = sd_bus_wait(opened, microseconds_until(end));
    if (progress < 0 && progress != -EINTR) return -progress;
  }
  return 0;
}

std::string words(int error) { return std::generic_category().message(error); }

/// Returns the lock, or a negative errno and its cause.
int inhibit(sd_bus* bus, const char* what, SteadyTime end, std::string& cause) {
  sd_bus_set_method_call_timeout(bus, microseconds_until(std::min(end, now() + kOneAnswer)));
  sd_bus_error error = SD_BUS_ERROR_NULL;
  sd_bus_message* answer = nullptr;
  int result = sd_bus_call_method(bus, "org.freedesktop.login1", "/org/freedesktop/login1",
                                  "org.freedesktop.login1.Manager", "Inhibit", &error, &answer, "ssss", what, "kphi",
                                  "the motor of the test stand may turn", "block");
  const Message owned(answer);
  int lent = -1;
  if (result >= 0) result = sd_bus_message_read(answer, "h", &lent);
  if (result >= 0) {
    result = fcntl(lent, F_DUPFD_CLOEXEC, 0);
    if (result < 0) result = -errno;
  }
  if (result < 0) cause = error.message != nullptr ? error.message : words(-result);
  sd_bus_error_free(&error);
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
  const SteadyTime end = now() + kAllAnswers;
  Bus bus;
  if (const int error = connect(bus); error != 0) {
    why_not_ = line("no connection to the system bus", words(error));
    return;
  }
  for (const char* what : kWhats) {
    std::string cause;
    const int answer = inhibit(bus.get(), what, end, cause);
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
