// The other end of both wires of this bench: the physics of kphi's simulator, an HX711 on its board, an ESC on its own.
// Written from the lines that the boards print, not from the drivers.
//
//   second_bench_stand SCALE ESC CONTROL [SUPPLY]    paths of serial lines and of the socket that says what is mounted
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <sstream>

#include "base/clock.hpp"
#include "base/descriptor.hpp"
#include "base/number.hpp"
#include "compensation/units.hpp"
#include "drivers/sim/physics/plant.hpp"
#include "drivers/sim/supply/port.hpp"
#include "drivers/sim/transport/conversations.hpp"
#include "drivers/sim/transport/pty.hpp"

namespace {

using namespace kphi;

constexpr double kConversionsPerSecond = 80.16;  // of an HX711's own oscillator, nominally 80
constexpr double kCountsPerNewton = 20'000;
constexpr double kLinesPerSecond = 100;
constexpr double kOwnStop_s = 0.25;
constexpr double kPolePairs = 7;
constexpr double kBoardNeeds_v = 6;  // the ESC's board lives on what the ESC gets
std::atomic<bool> quit{false};

std::string with_checksum(const std::string& words) {
  unsigned sum = 0;
  for (const unsigned char c : words) sum ^= c;
  char line[160];
  std::snprintf(line, sizeof line, "$%s*%02X\r\n", words.c_str(), sum);
  return line;
}

void say(sim::Pty& line, bool heard, const std::string& words) {
  if (!heard) return;
  const std::string text = with_checksum(words);
  (void)line.write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

class Stand {
 public:
  /// `supply`: of a supply that powers the ESC, off at first; nullptr: 12 V from somewhere.
  Stand(const std::string& scale, const std::string& esc, const char* supply)
      : scale_(scale), esc_(esc), plant_({}, 1) {
    if (supply == nullptr) return;
    supply_.emplace(sim::SupplySettings{.model = "RD6024", .faults = {}});
    supply_line_.emplace(sim::SupplyAddresses{supply, std::nullopt});
    plant_.power([this](double amps, double siemens) { return supply_->advance({amps, siemens}, now()); });
  }

  /// mount PROPELLER DEGREES; mute scale|esc (it says nothing any more); freeze scale (it repeats its last value);
  /// status: throttle and RPM.
  std::string answer(const std::string& request) {
    std::istringstream in(request);
    const std::vector<std::string> words(std::istream_iterator<std::string>(in), {});
    if (request == "status")
      return fmt::format("ok {:.0f} {:.0f}\n", throttle_, to_rpm(RadPerSec(plant_.motor().speed)));
    if (request == "mute scale" || request == "mute esc")
      return (request == "mute esc" ? esc_is_ : scale_is_) = false, "ok\n";
    if (request == "freeze scale") return scale_is_frozen_ = true, "ok\n";
    const auto angle = words.size() == 3 ? parse_double(words[2]) : std::nullopt;
    const sim::PropellerTruth* propeller = words.size() == 3 ? sim::find_propeller(words[1]) : nullptr;
    if (propeller == nullptr || !angle || words[0] != "mount") return "error expected: mount PROPELLER DEGREES\n";
    if (std::abs(plant_.motor().speed) > 5) return "error the motor is turning\n";
    plant_.mount(propeller, *angle);
    return "ok " + words[1] + " " + words[2] + "\n";
  }

  void advance(double to_s) {
    hear();
    if (supply_) supply_line_->receive(*supply_, now());
    if (supply_) supply_line_->send(*supply_, now());
    for (; time_s_ < to_s; time_s_ += sim::kTick) {
      plant_.step(stage());
      sum_ += plant_.reading()[2];
      ++ticks_;
      if (time_s_ >= next_conversion_s_) convert();
      if (time_s_ >= next_line_s_) report();
    }
  }

 private:
  [[nodiscard]] Instant now() const { return from_seconds(time_s_); }
  [[nodiscard]] bool board_lives() const { return plant_.motor().supply_volts > kBoardNeeds_v; }

  void hear() {
    std::array<std::uint8_t, 256> bytes{};
    const std::size_t n = esc_.read(bytes);
    if (!board_lives()) return;
    heard_.append(reinterpret_cast<const char*>(bytes.data()), n);
    for (std::size_t end; (end = heard_.find('\n')) != std::string::npos;) {
      std::string line = heard_.substr(0, end);
      heard_.erase(0, end + 1);
      if (!line.empty() && line.back() == '\r') line.pop_back();
      const std::size_t star = line.find('*');
      if (line.size() < 5 || line[0] != '$' || star == std::string::npos) continue;
      const std::string words = line.substr(1, star - 1), whole = with_checksum(words);
      if (whole.substr(0, whole.size() - 2) != line || words.substr(0, 2) != "T,") continue;
      const auto throttle = parse_double(words.substr(2));
      if (!throttle || *throttle < 0 || *throttle > 2000) continue;
      throttle_ = *throttle;
      ordered_s_ = time_s_;
    }
  }

  /// The ESC drives or coasts; it never feeds current back.
  [[nodiscard]] sim::PowerStage stage() {
    if (time_s_ - ordered_s_ > kOwnStop_s) throttle_ = 0;
    const double duty = throttle_ / 2000, volts = plant_.motor().supply_volts;
    const bool drives = throttle_ >= 48 && duty * volts > 0.0043 * plant_.motor().speed;
    return drives ? sim::PowerStage{sim::PowerStage::Mode::drive, duty} : sim::PowerStage{};
  }

  void convert() {
    next_conversion_s_ += 1 / kConversionsPerSecond;
    const double counts = std::round(kCountsPerNewton * sum_ / static_cast<double>(ticks_));
    if (!scale_is_frozen_) counts_ = static_cast<long>(std::clamp(counts, -8388608.0, 8388607.0));
    say(scale_, scale_is_, fmt::format("L,{},{}", ++conversions_, counts_));
    sum_ = 0;
    ticks_ = 0;
  }

  void report() {
    next_line_s_ += 1 / kLinesPerSecond;
    const sim::MotorState& motor = plant_.motor();
    say(esc_, esc_is_ && board_lives(),
        fmt::format("R,{:.0f},{:.0f},{:.0f},{:.0f},{:.0f}", throttle_, kPolePairs * to_rpm(RadPerSec(motor.speed)),
                    100 * motor.supply_volts, 100 * std::max(0.0, motor.supply_amps), motor.controller_celsius));
  }

  sim::Pty scale_, esc_;
  bool scale_is_ = true, esc_is_ = true;  ///< heard
  bool scale_is_frozen_ = false;
  long counts_ = 0;
  sim::Plant plant_;
  std::optional<sim::SupplySlave> supply_;
  std::optional<sim::SupplyPort> supply_line_;
  std::string heard_;
  double time_s_ = 0, throttle_ = 0, ordered_s_ = -1, next_conversion_s_ = 0, next_line_s_ = 0, sum_ = 0;
  std::uint64_t ticks_ = 0, conversions_ = 0;
};

Descriptor listen_at(const char* path) {
  ::unlink(path);
  Descriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
  if (::bind(socket.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(socket.number(), 4) != 0) {
    std::perror(path);
    std::exit(1);
  }
  return socket;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) {
    std::fputs("usage: second_bench_stand SCALE ESC CONTROL [SUPPLY]\n", stderr);
    return 2;
  }
  for (const int number : {SIGINT, SIGTERM}) std::signal(number, [](int) { quit = true; });
  Stand stand(argv[1], argv[2], argv[4]);  // argv ends with a nullptr
  sim::Conversations control(listen_at(argv[3]), 4, sim::each_question("\n", [&](std::string_view line) {
                               return sim::StreamReply{stand.answer(std::string(line))};
                             }));
  std::puts("ready");
  std::fflush(stdout);
  const SteadyClock clock;
  while (!quit) {
    ::poll(nullptr, 0, 1);
    stand.advance(to_seconds(clock.now()));
    control.serve();
  }
  ::unlink(argv[3]);
}
