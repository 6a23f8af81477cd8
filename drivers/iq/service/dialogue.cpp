#include "drivers/iq/service/dialogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "base/error.hpp"
#include "drivers/iq/session/connecting.hpp"

namespace kphi::iq {
namespace {

using std::chrono::steady_clock;
constexpr Duration kWriteLimit = std::chrono::milliseconds(500);
constexpr Duration kAdapter = std::chrono::milliseconds(50);  ///< bytes that only an adapter knows of may still leave

Duration on_wire(std::size_t bytes, unsigned baud) { return from_seconds(10.0 * static_cast<double>(bytes) / baud); }

constexpr Duration kLongestPatience = std::chrono::milliseconds(100);
constexpr Duration kShortestPatience = std::chrono::milliseconds(20);
constexpr auto kSlowRoundTrip = std::chrono::milliseconds(4);
constexpr int kAttempts = 2;
constexpr int kCoastAttempts = 5;
constexpr std::size_t kRoundTrips = 10000;
constexpr const Entry& kDriveMode = entry<"brushless_drive.drive_mode">;
constexpr const Entry& kCoast = entry<"propeller_motor_control.ctrl_coast">;

std::string path(const Entry& entry) { return fmt::format("{}.{}", name_of(entry.type), entry.name); }

Reply prove(Dialogue& module, const Setting& setting) {
  OpenInquiry open({setting.entry, setting.value});
  while (!open.done()) {
    module.tell(*setting.entry, setting.value);
    const auto answer = module.ask(*setting.entry);
    if (!answer) break;  // ask() has repeated the query by itself
    open.take(answer->value);
  }
  return open.reply();
}

}  // namespace

void Dialogue::tell(const Entry& entry, double value) {
  if (!is_volatile_setting(entry)) {
    throw std::logic_error(fmt::format("{}.{} is not a setting", name_of(entry.type), entry.name));
  }
  send(entry, value);
}

std::vector<Finding> set_and_read_back(Dialogue& module, std::span<const Setting> settings) {
  std::vector<Finding> findings;
  for (const Setting& setting : settings) {
    const Reply reply = prove(module, setting);
    if (reply.accepted || (!reply.value && !setting.required)) continue;
    findings.push_back(
        {Severity::fault,
         fmt::format("{} was set to {:.9g} {} and {}", path(*setting.entry), setting.value, setting.entry->unit,
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

bool is_reply_of(const Packet& packet, const Entry& asked, int module_id) noexcept {
  return packet.standard() && packet.access() == Access::reply && packet.module_id() == module_id &&
         packet.type == static_cast<std::uint8_t>(asked.type) && packet.sub() == asked.sub;
}

void Conversation::set_baud(unsigned baud) {
  port_.drain(kWriteLimit);
  std::this_thread::sleep_for(kAdapter);
  port_.set_baud(baud);
  parser_.reset();
  const std::array<std::uint8_t, kMaxFrame> zeros{};
  send(zeros);
}

bool Conversation::resynchronise() noexcept {
  const bool partial = parser_.partial();
  parser_.reset();
  return partial;
}

bool Conversation::tell(const Packet& packet) {
  std::array<std::uint8_t, kMaxFrame> frame;
  const std::size_t size = encode(packet, frame);
  return send(std::span(frame).first(size));
}

bool Conversation::send(std::span<const std::uint8_t> bytes) {
  for (const auto end = steady_clock::now() + kWriteLimit; !bytes.empty() && steady_clock::now() < end;) {
    bytes = bytes.subspan(port_.write(bytes));
    if (!bytes.empty()) port_.drain(std::chrono::milliseconds(2));
  }
  return bytes.empty();
}

std::optional<double> Conversation::ask(const Entry& asked, int module_id, Duration wall) {
  listen(Duration{0}, [](const Packet&) { return false; });  // late replies to the previous query
  tell(make(asked, Access::get, module_id));
  std::optional<double> answer;
  listen(wall + on_wire(port_.unsent() + kMaxFrame, baud()), [&](const Packet& packet) {
    if (!is_reply_of(packet, asked, module_id) || packet.data().size() != size_of(asked.format)) return false;
    answer = number(asked.format, packet.data());
    return true;
  });
  return answer;
}

void Conversation::coast(int module_id) {
  for (int i = 0; i < 3; ++i) {
    tell(set<"propeller_motor_control.ctrl_coast">(module_id));
    tell(set<"propeller_motor_control.ctrl_coast">(static_cast<int>(ModuleId::broadcast)));
  }
}

SerialDialogue::SerialDialogue(const SerialLine& port, const Clock& clock)
    : port_(port), clock_(clock), line_(port.device, port.baud) {
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
    // A late reply must not answer the next query: it passes while none is open.
    line_.listen(patience(), [this](const Packet&) {
      ++counters_.late_replies;
      return false;
    });
    counters_.take(line_.parsed());
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
                        fmt::format("slow line: a query and its reply take {:.1f} ms", 1e3 * to_seconds(median)),
                        "shorten the adapter's latency timer, or raise the baud rate"});
  if (counters_.crc_errors + counters_.wrong_length > 0)
    findings.push_back({Severity::warning,
                        fmt::format("{} damaged frames received", counters_.crc_errors + counters_.wrong_length),
                        "check cable, ground and baud rate"});
  return findings;
}

void SerialDialogue::send(const Entry& entry, double value) { write(make(entry, Access::set, port_.module_id, value)); }

void SerialDialogue::coast() noexcept {
  try {
    write(make(kCoast, Access::set, port_.module_id));
    ++counters_.coasts;
  } catch (const DeviceError&) {
    // The line is lost: the module's own communication timeout coasts the motor.
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
  if (mode >= 0) lose("coast", fmt::format("coast not confirmed (its drive mode last read {:g})", mode));
  if (counters_.bytes_in == 0) lose("ask", "nothing was received");
  if (counters_.packets == 0) lose("ask", "bytes were received, but no valid packet");
  if (counters_.wrong_module > 0) lose("ask", "only modules with another id answer");
  lose("ask", "no reply to get brushless_drive.drive_mode");
}

std::optional<Answer> SerialDialogue::ask_once(const Entry& entry) {
  const Packet question = make(entry, Access::get, port_.module_id);
  const Duration byte_time = clock_.stretched(from_seconds(10.0 / port_.baud));
  const Instant sent = clock_.now();
  const auto wall = steady_clock::now();
  write(question);
  ++counters_.requests;
  std::optional<Answer> answer;
  line_.listen(patience(), [&](const Packet& packet) {
    if (!answers(packet, entry)) return false;
    const Instant received = clock_.now();
    learn(steady_clock::now() - wall);
    // The module read the value after it had received the complete query and before its reply began to leave. A line
    // without real wire time (a pseudo-terminal) can be faster than that.
    Instant from = sent + byte_time * static_cast<int>(question.length + kFrameOverhead);
    Instant to = received - byte_time * static_cast<int>(packet.length + kFrameOverhead);
    if (to < from) {
      from = sent;
      to = received;
    }
    answer = Answer{number(entry.format, packet.data()), from + (to - from) / 2, (to - from + Duration(1)) / 2};
    return true;
  });
  counters_.take(line_.parsed());
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
  if (!is_reply_of(packet, asked, port_.module_id)) {
    const bool reply = packet.standard() && packet.access() == Access::reply;
    ++(reply && packet.module_id() != port_.module_id ? counters_.wrong_module : counters_.unasked);
    return false;
  }
  if (packet.data().size() == size_of(asked.format)) return true;
  ++counters_.wrong_length;
  return false;
}

void SerialDialogue::write(const Packet& packet) {
  if (!line_.tell(packet)) lose("write", "the port accepts no bytes");
  counters_.bytes_out += packet.length + kFrameOverhead;
}

void SerialDialogue::lose(const char* operation, const std::string& cause) const {
  throw DeviceError("IQ module on " + line_.device(), operation, cause,
                    "check its supply, the cable, the module id and the baud rate");
}

}  // namespace kphi::iq
