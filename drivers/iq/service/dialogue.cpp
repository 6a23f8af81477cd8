#include "drivers/iq/service/dialogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <thread>

#include "base/error.hpp"
#include "drivers/iq/link/motor.hpp"

namespace kphi::iq {
namespace {

constexpr Duration kLongestWait = std::chrono::seconds(1);
constexpr auto kSlowRoundTrip = std::chrono::milliseconds(4);

Settings settings_of(const SerialLine& line, const std::string& device, const Clock& clock) {
  Settings settings;
  settings.module_id = line.module_id;
  return stretched(settings, device, line.baud, clock);
}

}  // namespace

std::vector<Finding> set_and_read_back(Dialogue& module, std::span<const Setting> settings) {
  std::vector<Finding> findings;
  for (const Setting& setting : settings) {
    const Reply reply = module.inquire({setting.entry, setting.value});
    if (reply.accepted || (!reply.value && !setting.required)) continue;
    findings.push_back(
        {Severity::fault,
         fmt::format("{} was set to {:.9g} {} and {}", setting.entry->path, setting.value, setting.entry->unit,
                     reply.value ? fmt::format("reads back {:.9g}", *reply.value) : "does not answer"),
         "check the firmware version and the line to the module, then connect again"});
  }
  return findings;
}

std::vector<Setting> connection_settings(double module_timeout_s) {
  return {{&entry<"propeller_motor_control.timeout">, module_timeout_s},
          {&entry<"propeller_motor_control.timeout_behavior">, static_cast<double>(TimeoutBehavior::coast), false},
          {&entry<"propeller_motor_control.timeout_song_option">, static_cast<double>(SongOption::never), false}};
}

SerialDialogue::SerialDialogue(const SerialLine& port, const Clock& clock)
    : port_(port), clock_(clock), line_(port.device, port.baud), session_(settings_of(port, line_.device(), clock)) {
  session_.inspect(clock.now());
  pump([&] { return session_.state() != Session::State::connecting; });
  if (session_.state() == Session::State::ready) return;
  send_final_coast(line_, port_.module_id);
  throw DeviceError("IQ module on " + device(), "connect", session_.failure(),
                    "check its supply, the cable, the module id and the baud rate");
}

SerialDialogue::~SerialDialogue() { send_final_coast(line_, port_.module_id); }

Reply SerialDialogue::inquire(const Inquiry& inquiry) {
  session_.inquire({inquiry}, clock_.now());
  pump([&] { return session_.inquiries().done(); });
  return session_.inquiries().replies().front();
}

void SerialDialogue::pause(Duration bench) { std::this_thread::sleep_for(clock_.shrunk(bench)); }

Duration SerialDialogue::median_round_trip() const { return clock_.shrunk(session_.round_trips().quantile(0.5)); }

std::vector<Finding> SerialDialogue::findings() const {
  std::vector<Finding> findings;
  const Duration median = median_round_trip();
  if (median > kSlowRoundTrip)
    findings.push_back({Severity::warning,
                        fmt::format("slow line: a query and its reply take {:.1f} ms", 1e3 * to_seconds(median)),
                        "shorten the adapter's latency timer, or raise the baud rate"});
  const std::uint64_t damaged = counters().crc_errors + counters().wrong_length;
  if (damaged > 0)
    findings.push_back(
        {Severity::warning, fmt::format("{} damaged frames received", damaged), "check cable, ground and baud rate"});
  return findings;
}

template <class Done>
void SerialDialogue::pump(Done&& done) {
  while (!done()) {
    for (std::size_t n = 1; n > 0 && !session_.output().empty(); session_.sent(n)) n = line_.write(session_.output());
    const Duration left = std::clamp(session_.deadline() - clock_.now(), Duration{0}, kLongestWait);
    if (line_.wait(clock_.shrunk(left))) {
      std::array<std::uint8_t, 512> buffer;
      const std::size_t n = line_.read(buffer);
      session_.receive(std::span(buffer).first(n), clock_.now());
    }
    session_.advance(clock_.now());
  }
}

}  // namespace kphi::iq
