#include "drivers/iq/serial_dialogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "drivers/device_error.hpp"

namespace kphi::iq {
namespace {

using SteadyTime = std::chrono::steady_clock;

constexpr Duration kLongestPatience = std::chrono::milliseconds(100);
constexpr Duration kShortestPatience = std::chrono::milliseconds(20);
constexpr auto kSlowRoundTrip = std::chrono::milliseconds(4);
constexpr int kAttempts = 2;
constexpr int kCoastAttempts = 5;
constexpr std::size_t kRoundTrips = 10000;
constexpr const Entry& kDriveMode = entry<"brushless_drive.drive_mode">;
constexpr const Entry& kCoast = entry<"propeller_motor_control.ctrl_coast">;

}  // namespace

SerialDialogue::SerialDialogue(const DialoguePlace& place, const Clock& clock)
    : place_(place), clock_(clock), line_(place.device, place.baud) {
  coast();
  try {
    prove_coast();
  } catch (...) {
    coast();
    throw;
  }
}

SerialDialogue::~SerialDialogue() {
  for (int i = 0; i < 3; ++i) coast();
}

std::optional<Answer> SerialDialogue::ask(const Entry& entry) {
  for (int i = 0; i < kAttempts; ++i) {
    if (const auto answer = ask_once(entry)) return answer;
    // A late reply must not answer the next question: it passes while nothing is asked.
    line_.listen(patience(), [this](const Packet&) {
      ++counters_.late_replies;
      return false;
    });
    count_parser();
  }
  return std::nullopt;
}

void SerialDialogue::pause(Duration bench) { std::this_thread::sleep_for(clock_.shrunk(bench)); }

Duration SerialDialogue::median_round_trip() const {
  if (round_trips_.empty()) return Duration{0};
  std::vector<Duration> sorted = round_trips_;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

std::vector<Finding> SerialDialogue::findings() const {
  std::vector<Finding> findings;
  const Duration median = median_round_trip();
  if (median > kSlowRoundTrip)
    findings.push_back({Severity::warning,
                        fmt::format("a question and its reply take {:.1f} ms", 1e3 * to_seconds(median)),
                        "shorten the adapter's latency timer, or raise the baud rate"});
  if (counters_.crc_errors + counters_.wrong_length > 0)
    findings.push_back({Severity::warning,
                        fmt::format("{} frames came damaged", counters_.crc_errors + counters_.wrong_length),
                        "check cable, ground and baud rate"});
  return findings;
}

void SerialDialogue::send(const Entry& entry, double value) {
  write(make(entry, Access::set, place_.module_id, value));
}

void SerialDialogue::coast() noexcept {
  try {
    write(make(kCoast, Access::set, place_.module_id));
    ++counters_.coasts;
  } catch (const DeviceError&) {
    // The line is gone: the module's own communication timeout coasts it.
  }
}

void SerialDialogue::prove_coast() {
  double mode = -1;
  for (int i = 0; i < kCoastAttempts; ++i) {
    coast();
    const auto answer = ask_once(kDriveMode);
    mode = answer ? answer->value : mode;
    if (mode == static_cast<double>(DriveMode::coast)) return;
  }
  ++counters_.unconfirmed_coasts;
  if (mode >= 0) lose("coast", fmt::format("it does not confirm (its drive mode last read {:g})", mode));
  if (counters_.bytes_in == 0) lose("ask", "nothing was received");
  if (counters_.packets == 0) lose("ask", "bytes were received, but no valid packet");
  if (counters_.wrong_module > 0) lose("ask", "only modules with another id answer");
  lose("ask", "it does not tell its drive mode");
}

std::optional<Answer> SerialDialogue::ask_once(const Entry& entry) {
  const Packet question = make(entry, Access::get, place_.module_id);
  const Duration byte_time = clock_.stretched(from_seconds(10.0 / place_.baud));
  const Instant sent = clock_.now();
  const auto wall = SteadyTime::now();
  write(question);
  ++counters_.requests;
  std::optional<Answer> answer;
  line_.listen(patience(), [&](const Packet& packet) {
    if (!answers(packet, entry)) return false;
    const Instant received = clock_.now();
    learn(SteadyTime::now() - wall);
    // The module read the value after the question had come in whole and before its reply began to leave. A line
    // without real wire time (a pseudo-terminal) can be quicker than that.
    Instant from = sent + byte_time * static_cast<int>(question.length + kFrameOverhead);
    Instant to = received - byte_time * static_cast<int>(packet.length + kFrameOverhead);
    if (to < from) {
      from = sent;
      to = received;
    }
    answer = Answer{number(entry.format, packet.data()), from + (to - from) / 2, (to - from + Duration(1)) / 2};
    return true;
  });
  count_parser();
  if (answer) {
    ++counters_.replies;
    if (!std::isfinite(answer->value)) ++counters_.bad_values;
    return answer;
  }
  ++counters_.timeouts;
  if (line_.resynchronise()) ++counters_.resyncs;
  return answer;
}

void SerialDialogue::learn(Duration round_trip) {
  typical_round_trip_ =
      round_trips_.empty() ? round_trip : typical_round_trip_ + (round_trip - typical_round_trip_) / 8;
  round_trips_.push_back(round_trip);
  if (round_trips_.size() > kRoundTrips) round_trips_.erase(round_trips_.begin(), round_trips_.end() - kRoundTrips / 2);
}

Duration SerialDialogue::patience() const noexcept {
  if (round_trips_.empty()) return kLongestPatience;
  return std::clamp(10 * typical_round_trip_, kShortestPatience, kLongestPatience);
}

bool SerialDialogue::answers(const Packet& packet, const Entry& asked) noexcept {
  if (!is_reply_of(packet, asked, place_.module_id)) {
    const bool reply = packet.standard() && packet.access() == Access::reply;
    ++(reply && packet.module_id() != place_.module_id ? counters_.wrong_module : counters_.unasked);
    return false;
  }
  if (packet.data().size() == size_of(asked.format)) return true;
  ++counters_.wrong_length;
  return false;
}

void SerialDialogue::write(const Packet& packet) {
  if (!line_.tell(packet)) lose("write", "the line takes no bytes");
  counters_.bytes_out += packet.length + kFrameOverhead;
}

void SerialDialogue::count_parser() noexcept {
  const Parser::Counters& parsed = line_.heard();
  counters_.bytes_in = parsed.bytes;
  counters_.packets = parsed.packets;
  counters_.crc_errors = parsed.crc_errors;
  counters_.refused_lengths = parsed.refused_lengths;
  counters_.discarded_bytes = parsed.discarded_bytes;
}

void SerialDialogue::lose(const char* operation, const std::string& cause) const {
  throw DeviceError("IQ module on " + line_.device(), operation, cause,
                    "check its supply, the cable, the module id and the baud rate");
}

}  // namespace kphi::iq
