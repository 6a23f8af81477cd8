#include "test/daq/private_bus.hpp"

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

namespace kphi::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr const char* kAddress = "DBUS_SYSTEM_BUS_ADDRESS";
constexpr const char* kLogind = "org.freedesktop.login1";
constexpr const char* kObject = "/org/freedesktop/login1";
constexpr const char* kManager = "org.freedesktop.login1.Manager";

/// Throws what sd-bus returned, if that is an error.
int checked(int result, const char* operation) {
  if (result < 0) throw std::runtime_error(std::string(operation) + ": " + std::strerror(-result));
  return result;
}

int mark(sd_bus_message*, void* happened, sd_bus_error*) {
  *static_cast<bool*>(happened) = true;
  return 0;
}

}  // namespace

PrivateBus::PrivateBus()
    : daemon_({"dbus-daemon", "--session", "--nofork", "--nopidfile", "--print-address",
               "--address=unix:path=" + (folder_ / "bus").string()}) {
  setenv(kAddress, daemon_.wait_for("unix:path=").c_str(), 1);
  checked(sd_bus_open_system(&connection_), "connect to the test's own bus");
}

PrivateBus::~PrivateBus() {
  sd_bus_close_unref(connection_);
  unsetenv(kAddress);
}

std::unique_ptr<Process> PrivateBus::start_owner(const std::string& name,
                                                 const std::vector<std::string>& arguments) const {
  bool owned = false;
  sd_bus_slot* slot = nullptr;
  const std::string rule = "type='signal',sender='org.freedesktop.DBus',member='NameOwnerChanged',arg0='" + name + "'";
  checked(sd_bus_add_match(connection_, &slot, rule.c_str(), mark, &owned), "listen for the owner of a name");
  auto process = std::make_unique<Process>(arguments);
  const auto give_up = Clock::now() + 60s;
  while (!owned && Clock::now() < give_up) {
    const int progress = checked(sd_bus_process(connection_, nullptr), "read the test's own bus");
    if (progress == 0) checked(sd_bus_wait(connection_, 1'000'000), "wait for the test's own bus");
  }
  sd_bus_slot_unref(slot);
  if (!owned) throw std::runtime_error("nobody took the name " + name);
  return process;
}

bool LogindMock::available() {
  return std::system("dbus-daemon --version >/dev/null 2>&1") == 0 &&
         std::system("/usr/bin/python3 -c 'import dbusmock' >/dev/null 2>&1") == 0;
}

LogindMock::LogindMock(const PrivateBus& bus)
    : bus_(bus),
      // Debian's python3, which sees Debian's modules. Its log would fill a pipe that nobody reads.
      process_(bus.start_owner(kLogind, {"/usr/bin/python3", "-m", "dbusmock", "--system", "--template", "logind",
                                         "--logfile", "/dev/null"})) {}

std::vector<Inhibitor> LogindMock::inhibitors() const {
  sd_bus_message* answer = nullptr;
  checked(
      sd_bus_call_method(bus_.connection(), kLogind, kObject, kManager, "ListInhibitors", nullptr, &answer, nullptr),
      "ListInhibitors");
  checked(sd_bus_message_enter_container(answer, 'a', "(ssssuu)"), "read the inhibitors");
  std::vector<Inhibitor> found;
  const char *what, *who, *why, *mode;
  unsigned uid, pid;
  while (sd_bus_message_read(answer, "(ssssuu)", &what, &who, &why, &mode, &uid, &pid) > 0)
    found.push_back({what, who, why, mode});
  sd_bus_message_unref(answer);
  return found;
}

std::vector<Inhibitor> LogindMock::inhibitors_once_they_are(std::size_t count) const {
  const auto give_up = Clock::now() + 10s;
  for (;;) {
    auto found = inhibitors();
    if (found.size() == count || Clock::now() > give_up) return found;
  }
}

void LogindMock::refuse(const std::string& part) const {
  const std::string code = "from dbusmock.templates import logind\nif '" + part +
                           "' in args[0]:\n"
                           "    raise dbus.exceptions.DBusException('Permission denied',\n"
                           "                                        name='org.freedesktop.DBus.Error.AccessDenied')\n"
                           "ret = logind.Inhibit(self, *args)\n";
  checked(sd_bus_call_method(bus_.connection(), kLogind, kObject, "org.freedesktop.DBus.Mock", "AddMethod", nullptr,
                             nullptr, "sssss", kManager, "Inhibit", "ssss", "h", code.c_str()),
          "AddMethod");
}

}  // namespace kphi::test
