#include "daq/run/progress.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cmath>

namespace kphi::daq {
namespace {

std::string minutes_and_seconds(double seconds) {
  const long whole = std::lround(seconds);
  if (whole >= 3600) return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
  return fmt::format("{:02}:{:02}", whole / 60, whole % 60);
}

/// Characters, not bytes: φ and ° take two.
std::size_t width_of(const std::string& line) {
  return static_cast<std::size_t>(
      std::ranges::count_if(line, [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

/// "44 %", and 100 % only at the end.
std::string share_done(const Position& position) { return fmt::format("{:.0f} %", std::floor(100 * position.done)); }

/// '?' if nothing comes any more, '–' if it has no zero yet.
std::string load_words(const Observation& seen, const char* format, double value) {
  if (!seen.load_cell_is_fresh()) return "?";
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "–";
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

std::string describe(const Position& position, const Observation& seen, std::size_t columns) {
  const auto speed = [&](const char* format) {
    return seen.motor_is_fresh() ? fmt::format(fmt::runtime(format), to_rpm(seen.speed())) : std::string("?");
  };
  const std::string thrust = load_words(seen, "{:.3f}", seen.thrust_n);
  const std::string left = minutes_and_seconds(position.remaining_s);
  const std::string which = position.repetition < 0
                                ? fmt::format("ref {}", -position.repetition)
                                : fmt::format("rep {}/{}", position.repetition, position.repetitions);
  const std::string run =
      position.run == 0 ? "" : fmt::format("{:2}/{} {}  ", position.run, position.runs, share_done(position));
  const std::string what = position.step < 0 ? fmt::format("{:<10}", position.phase)
                                             : fmt::format("step {:2}/{}", position.step + 1, position.steps);
  const std::string whole = fmt::format("{}{}  φ {:3g}°  {}  {}  speed {:>5} of {:5.0f} RPM  thrust {:>6} N  left {}",
                                        run, position.propeller.data(), position.occlusion_deg, which, what,
                                        speed("{:.0f}"), to_rpm(position.commanded), thrust, left) +
                            silence(seen);
  if (width_of(whole) <= columns) return whole;
  const std::string short_run =
      position.run == 0 ? "" : fmt::format("{}/{} {} ", position.run, position.runs, share_done(position));
  const std::string short_what =
      position.step < 0 ? std::string(position.phase) : fmt::format("{}/{}", position.step + 1, position.steps);
  return fmt::format("{}φ {:g}° {} {}/{:.0f} RPM {} N {}", short_run, position.occlusion_deg, short_what,
                     speed("{:.0f}"), to_rpm(position.commanded), thrust, left);
}

std::string describe_by_hand(const Position& position, const Observation& seen, std::size_t) {
  const auto known = [](bool is_known, const char* format, double value) {
    return is_known ? fmt::format(fmt::runtime(format), value) : std::string("?");
  };
  const double watts = seen.judged[Watched::supply_voltage_low] * seen.judged[Watched::supply_current];
  const Vibration& shakes = seen.vibration;
  const double rms_n = std::hypot(shakes.rms[0], shakes.rms[1], shakes.rms[2]);
  std::string words =
      fmt::format("{:>5}{} RPM  thrust {:>6} N  torque {:>6} mN m  {:>4} W  shakes {} N rms",
                  known(seen.motor_is_fresh(), "{:.0f}", to_rpm(seen.speed())),
                  position.commanded > RadPerSec(0) ? fmt::format(" of {:5.0f}", to_rpm(position.commanded)) : "",
                  load_words(seen, "{:.3f}", seen.thrust_n), load_words(seen, "{:.1f}", 1e3 * seen.torque_nm),
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
  const std::size_t columns = width_of(stream_) - 1;
  put(stream_, fmt::format("\r{}\x1b[K", cut(words_(position, seen, columns), columns)), Worth::live);
  drawn_ = true;
}

void PrintedProgress::step_done(const Position& position, const Observation& seen) {
  if (!on_terminal_) put(stream_, fmt::format("{}\n", words_(position, seen, kAnyWidth)), Worth::passing);
}

void PrintedProgress::say(const std::string& line) { put(stream_, fmt::format("{}{}\n", clearing(), line)); }

}  // namespace kphi::daq
