#include "daq/run/progress.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>

#include <cmath>

namespace kphi::daq {
namespace {

std::string minutes_and_seconds(double seconds) {
  const long whole = static_cast<long>(seconds + 0.5);
  if (whole >= 3600) return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
  return fmt::format("{:02}:{:02}", whole / 60, whole % 60);
}

std::size_t width_of(std::FILE* stream) {
  winsize size{};
  if (ioctl(fileno(stream), TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 120;
  return size.ws_col;
}

/// At most `columns` characters, not bytes: φ and ° take two.
std::string cut(const std::string& line, std::size_t columns) {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const bool starts_character = (static_cast<unsigned char>(line[i]) & 0xC0) != 0x80;
    if (starts_character && seen++ == columns) return line.substr(0, i);
  }
  return line;
}

/// Which values are stale, and for how long.
std::string silence(const Observation& seen) {
  std::string words;
  if (!seen.motor_is_fresh()) words += fmt::format("  no speed for {:.1f} s", to_seconds(seen.motor_age));
  if (!seen.load_cell_is_fresh()) words += fmt::format("  no thrust for {:.1f} s", to_seconds(seen.load_cell_age));
  return words;
}

}  // namespace

std::string describe(const Position& position, const Observation& seen) {
  const std::string which = position.repetition < 0
                                ? fmt::format("ref {}", -position.repetition)
                                : fmt::format("rep {}/{}", position.repetition, position.repetitions);
  const std::string where = fmt::format("{}  φ {:3g}°  {}", position.propeller.data(), position.occlusion_deg, which);
  const std::string what = position.step < 0 ? fmt::format("{:<10}", position.phase)
                                             : fmt::format("step {:2}/{}", position.step + 1, position.steps);
  return fmt::format("{}  {}  speed {} of {:5.0f} RPM  thrust {} N  left {}", where, what,
                     seen.motor_is_fresh() ? fmt::format("{:5.0f}", to_rpm(seen.speed())) : "    ?",
                     to_rpm(position.commanded),
                     seen.load_cell_is_fresh() ? fmt::format("{:6.3f}", seen.thrust_n) : "     ?",
                     minutes_and_seconds(position.remaining_s)) +
         silence(seen);
}

std::string describe_by_hand(const Position& position, const Observation& seen) {
  const auto known = [](bool is_known, const char* format, double value) {
    return is_known ? fmt::format(fmt::runtime(format), value) : std::string("?");
  };
  const bool loaded = seen.load_cell_is_fresh();
  const double watts = seen.judged[Watched::supply_voltage_low] * seen.judged[Watched::supply_current];
  const Vibration& shakes = seen.vibration;
  const double rms_n = std::hypot(shakes.rms[0], shakes.rms[1], shakes.rms[2]);
  std::string words =
      fmt::format("{:>5}{} RPM  thrust {:>6} N  torque {:>6} mN m  {:>4} W  shakes {} N rms",
                  known(seen.motor_is_fresh(), "{:.0f}", to_rpm(seen.speed())),
                  position.commanded > RadPerSec(0) ? fmt::format(" of {:5.0f}", to_rpm(position.commanded)) : "",
                  known(loaded, "{:.3f}", seen.thrust_n), known(loaded, "{:.1f}", 1e3 * seen.torque_nm),
                  known(seen.motor_is_fresh() && std::isfinite(watts), "{:.0f}", watts),
                  known(std::isfinite(rms_n), "{:.2f}", rms_n));
  if (std::isfinite(shakes.blade_pass_n))
    words += fmt::format("  blades {:.3f} N at {:.0f} Hz", shakes.blade_pass_n, shakes.blade_pass_hz);
  return (position.step < 0 && !position.phase.empty() ? fmt::format("{:<10}", position.phase) : "") + words +
         silence(seen);
}

PrintedProgress::~PrintedProgress() { put(stream_, clearing(), Worth::live); }

void PrintedProgress::tick(const Position& position, const Observation& seen) {
  const auto now = std::chrono::steady_clock::now();
  if (!on_terminal_ || now < next_) return;
  next_ = now + std::chrono::milliseconds(100);
  put(stream_, fmt::format("\r{}\x1b[K", cut(words_(position, seen), width_of(stream_) - 1)), Worth::live);
  drawn_ = true;
}

void PrintedProgress::step_done(const Position& position, const Observation& seen) {
  if (!on_terminal_) put(stream_, fmt::format("{}\n", words_(position, seen)), Worth::passing);
}

void PrintedProgress::say(const std::string& line) { put(stream_, fmt::format("{}{}\n", clearing(), line)); }

}  // namespace kphi::daq
