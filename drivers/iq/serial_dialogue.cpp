#include "drivers/iq/serial_dialogue.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
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
    : place_(place), clock_(clock), port_(place.device, place.baud) {
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
    listen(SteadyTime::now() + patience(), [this](const Packet&) {
      ++counters_.late_replies;
      return false;
    });
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
  const WallTime wall = SteadyTime::now();
  write(question);
  ++counters_.requests;
  std::optional<Answer> answer;
  listen(wall + patience(), [&](const Packet& packet) {
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
  if (answer) {
    ++counters_.replies;
    if (!std::isfinite(answer->value)) ++counters_.bad_values;
    return answer;
  }
  ++counters_.timeouts;
  if (parser_.partial()) {
    ++counters_.resyncs;
    parser_.reset();
  }
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
  const bool reply = packet.standard() && packet.access() == Access::reply;
  if (reply && packet.module_id() != place_.module_id) {
    ++counters_.wrong_module;
    return false;
  }
  if (!reply || packet.type != static_cast<std::uint8_t>(asked.type) || packet.sub() != asked.sub) {
    ++counters_.unasked;
    return false;
  }
  if (packet.data().size() == size_of(asked.format)) return true;
  ++counters_.wrong_length;
  return false;
}

template <class Sink>
bool SerialDialogue::listen(WallTime until, Sink&& sink) {
  std::uint8_t buffer[512];
  bool stop = false;
  while (!stop) {
    const std::size_t n = read(buffer, until);
    if (n == 0) break;
    parser_.push(std::span<const std::uint8_t>(buffer, n),
                 [&](const Packet& packet, auto) { stop = sink(packet) || stop; });
    count_parser();
  }
  return stop;
}

std::size_t SerialDialogue::read(std::span<std::uint8_t> buffer, WallTime until) {
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - SteadyTime::now());
    pollfd line{port_.fd(), POLLIN, 0};
    const int ready = ::poll(&line, 1, static_cast<int>(std::max<std::int64_t>(0, left.count())));
    if (ready < 0 && errno == EINTR) continue;
    if (ready < 0) lose("read", std::strerror(errno));
    if (ready == 0) return 0;
    const auto n = ::read(port_.fd(), buffer.data(), buffer.size());
    if (n > 0) return static_cast<std::size_t>(n);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    lose("read", n == 0 ? "the line was closed" : std::strerror(errno));
  }
}

void SerialDialogue::write(const Packet& packet) {
  std::array<std::uint8_t, kMaxFrame> frame;
  const std::size_t size = encode(packet, frame);
  const WallTime until = SteadyTime::now() + kLongestPatience;
  for (std::size_t done = 0; done < size;) {
    const auto n = ::write(port_.fd(), frame.data() + done, size - done);
    if (n > 0) {
      done += static_cast<std::size_t>(n);
      continue;
    }
    if (n < 0 && errno != EAGAIN && errno != EINTR) lose("write", std::strerror(errno));
    if (SteadyTime::now() > until) lose("write", "the line takes no bytes");
    pollfd line{port_.fd(), POLLOUT, 0};
    ::poll(&line, 1, 10);
  }
  counters_.bytes_out += size;
}

void SerialDialogue::count_parser() noexcept {
  const Parser::Counters& parsed = parser_.counters();
  counters_.bytes_in = parsed.bytes;
  counters_.packets = parsed.packets;
  counters_.crc_errors = parsed.crc_errors;
  counters_.refused_lengths = parsed.refused_lengths;
  counters_.discarded_bytes = parsed.discarded_bytes;
}

void SerialDialogue::lose(const char* operation, const std::string& cause) const {
  throw DeviceError("IQ module on " + port_.device(), operation, cause,
                    "check its supply, the cable, the module id and the baud rate");
}

}  // namespace kphi::iq
