// Logs of thrust stands as text, with the defects that real logs have, from a known k and a seed; beside each the rows
// that must be fitted and the findings that must be reported.
#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "base/random.hpp"
#include "compensation/units.hpp"
#include "fit/logs/log_audit.hpp"
#include "fit/model/thrust_fit.hpp"

namespace kphi::fit {

struct KnownFinding {
  FindingKind kind{};
  std::size_t rows = 0;  ///< 0: any number
  std::string text{};    ///< part of it
};

struct KnownLog {
  std::string name, text;
  RowSelection selection{};
  std::size_t rows_total = 0;
  std::vector<Point> used{};             ///< speed and thrust of the rows that `selection` must take
  std::vector<KnownFinding> findings{};  ///< all of them, in order
};

inline double newtons(double k, double rpm) { return k * from_rpm(rpm).value() * from_rpm(rpm).value(); }

struct SweepDefects {
  bool speed_missing = false, current_limit = false, barely_turning = false, negative = false;
};

/// Series 1520: eleven averaged steps in gf, electrical speed, the optical sensor not connected.
inline KnownLog averaged_sweep(double k, const SweepDefects& defects = {}) {
  constexpr double kGramForce = 9.80665e-3;
  KnownLog log{"sweep",
               "\xEF\xBB\xBFTime (s),ESC signal (µs),Servo 1 (µs),Thrust (gf),Voltage (V),Current (A),Motor Electrical "
               "Speed (RPM),Motor Optical Speed (RPM),Electrical Power (W),App message,\n",
               {.speed = SpeedSource::electrical},
               11};
  double rpm = 0, volts = 7.4;
  for (int i = 0; i < 11; ++i) {
    rpm = 3400 + 1300.0 * i;
    volts -= 0.01;
    if (defects.current_limit && i > 8) {
      rpm = (3400 + 1300.0 * 8) * (i == 9 ? 0.97 : 0.94);
      volts *= 0.85;
    }
    double gram = newtons(k, rpm) / kGramForce;
    if (i == 0 && defects.speed_missing) rpm = 0;
    if (i == 0 && defects.barely_turning) rpm = 2, gram = 0.3;
    if (i == 0 && defects.negative) rpm = 0, gram = -40;
    if (rpm > 0) log.used.push_back({from_rpm(rpm).value(), gram * kGramForce, 1});
    log.text += fmt::format("{},{},,{},{},{},{},0,{},,\n", 2.2 * i, 1050 + 95 * i, gram, volts, 0.4 + i, rpm,
                            volts * (0.4 + i));
  }
  if (defects.speed_missing) log.findings.push_back({FindingKind::speed_missing, 1, "speed reads 0"});
  if (defects.barely_turning) log.findings.push_back({FindingKind::barely_turning, 1});
  if (defects.negative) log.findings.push_back({FindingKind::not_turning, 1});
  if (defects.current_limit) log.findings.push_back({FindingKind::current_limit, 2, "(10.40 A)"});
  if (defects.negative) log.findings.push_back({FindingKind::negative_thrust, 1});
  return log;
}

/// Series 1585: kgf, both speeds, 14 poles set for a motor of 12; the electrical speed of row `wrong` is 10 % too high,
/// so optical/electrical is 1/1.1 of its usual value there.
inline KnownLog two_speeds(double k, RowSelection selection, int wrong = -1) {
  constexpr double kKilogramForce = 9.80665;
  KnownLog log{"dyno",
               "Time (s),ESC signal (µs),Torque (N·m),Thrust (kgf),Voltage (V),Current (A),Motor Electrical Speed "
               "(RPM),Motor Optical Speed (RPM),Vibration (g),App message,\n",
               selection, 16};
  for (int i = 0; i < 16; ++i) {
    const double optical = i == 0 ? 0 : 2100 + 600.0 * i;
    const double electrical = optical * 6 / 7 * (i == wrong ? 1.1 : 1);
    const double kilogram = i == 0 ? 0.001 : newtons(k, optical) / kKilogramForce;
    log.text += fmt::format("{},{},-0.01,{},{},{},{},{},0.06,,\n", 2.0 * i, 1000 + 60 * i, kilogram, 16 - 0.02 * i,
                            0.2 * i, electrical, optical);
    const bool optical_used = selection.speed == SpeedSource::optical;
    if (i == 0) continue;
    log.used.push_back(
        {from_rpm(optical_used ? optical : electrical * selection.speed_factor).value(), kilogram * kKilogramForce, 1});
  }
  log.findings.push_back({FindingKind::speed_ratio, 15, "7/6, as if 14 poles were set for a motor of 12"});
  if (wrong > 0) log.findings.push_back({FindingKind::speed_disagrees, 1, "-9.1 %"});
  return log;
}

inline std::string series_header(const char* more) {
  return fmt::format(
      "\xEF\xBB\xBFTime (s),ESC (µs),Servo (µs),Thrust (N),Voltage (V),Motor Optical Speed (RPM),4N76 "
      "Temp (ºC),App message,{}\n",
      more);
}

/// Series 1780, a ramp and a plateau in N: never tared, its zero drifts, its noise is correlated.
inline KnownLog untared_ramp(double k, std::uint64_t seed) {
  KnownLog log{"ramp",
               series_header(""),
               {.speed = SpeedSource::optical, .speed_above_rpm = 1000, .throttle_above_us = 1100, .tare_rows = 100}};
  Random random(seed);
  std::vector<double> tare;
  double slow = 0;
  const auto row = [&](double throttle, double rpm, double zero_n, double noise_n) {
    const double thrust = newtons(k, rpm) + zero_n + noise_n,
                 time = log.rows_total < 2 ? 0 : 0.04 * static_cast<double>(log.rows_total);
    log.text += fmt::format("{},{},,{},30,{},3.4,,\n", time, throttle, thrust, rpm);
    if (log.rows_total++ < 100) tare.push_back(thrust);
    if (rpm > 1000 && throttle > 1100) log.used.push_back({from_rpm(rpm).value(), thrust, 1});
  };
  for (int i = 0; i < 252; ++i) row(1000, 0, -4.104, 0.009 * random.normal());
  for (int i = 0; i < 71; ++i) row(1080, 0, -4.104, 0.009 * random.normal());
  for (int i = 0; i < 300; ++i) row(1150 + i, 600 + 18.0 * i, -4.1, 0.009 * random.normal());
  for (int i = 0; i < 400; ++i) {
    slow = 0.9 * slow + 0.02 * random.normal();
    row(1450, 6000, -4.06, slow);
  }
  for (int i = 0; i < 90; ++i) row(1000, 5000 - 55.0 * i, -4.02, 0.009 * random.normal());
  for (int i = 0; i < 41; ++i) row(1000, 0, -4.011, 0.009 * random.normal());
  double mean = 0;
  for (const double thrust : tare) mean += thrust / 100;
  for (Point& point : log.used) point.thrust_n -= mean;
  log.findings = {
      {FindingKind::not_turning, 71},       {FindingKind::coasting, 90},
      {FindingKind::untared, 252, "-4.10"}, {FindingKind::zero_drifted, 252 + 41, "N after (41 rows, sd 0.0"},
      {FindingKind::negative_thrust},       {FindingKind::time_repeated, 1},
      {FindingKind::correlated_noise}};
  return log;
}

/// Series 1780 at constant speed: a message with unquoted commas, stamps that go back, speed spikes, thrust that
/// drifts, no rows with the motor off.
inline KnownLog drifting_plateau(double k, std::uint64_t seed) {
  KnownLog log{
      "constant",
      series_header("TargetRPM,Mark,") + "0,,,7.7,29.8,1510,0.1,Cutoff: limitSwitch (val=1, limit=0),2500,0,\n",
      {.speed = SpeedSource::optical, .speed_above_rpm = 1000},
      1};
  Random random(seed);
  std::size_t backward = 0, spikes = 0;
  for (int i = 0; i < 600; ++i) {
    const bool spike = i % 50 == 20, slow = i >= 590;
    const double true_rpm = slow ? 600 : 3500;
    const double rpm = spike ? 17 * true_rpm + i : true_rpm + 2 * random.normal();
    const double thrust = slow ? -0.3 - 1e-3 * i : newtons(k, true_rpm) * (1 - 2e-4 * i) + 0.02 * random.normal();
    double time = 0.04 * i;
    if (i == 0) time = 306.011;
    if (i > 1 && i % 10 == 0) time -= 0.1;
    if (i == 55) time = 0.04 * 54;
    backward += i == 1 || (i > 1 && i % 10 == 0) ? 1 : 0;
    spikes += spike ? 1 : 0;
    log.text += fmt::format("{},1450,,{},29.6,{},3.4,,3500,0,\n", time, thrust, rpm);
    ++log.rows_total;
    if (rpm > 1000) log.used.push_back({from_rpm(rpm).value(), thrust, 1});
  }
  log.findings = {{FindingKind::speed_spike, spikes, "up to 60070 RPM"},
                  {FindingKind::zero_missing, 600},
                  {FindingKind::negative_thrust, 10, "-0.8990 N"},
                  {FindingKind::time_backward, backward, "305.971 s"},
                  {FindingKind::time_repeated, 1},
                  {FindingKind::thrust_drifts},
                  {FindingKind::other_fields, 1}};
  return log;
}

/// All of them. Every number follows from the seed.
inline std::vector<KnownLog> known_logs() {
  const RowSelection electrical{.speed = SpeedSource::electrical, .speed_factor = 7.0 / 6, .speed_above_rpm = 1000};
  const RowSelection optical{.speed = SpeedSource::optical, .speed_above_rpm = 1000};
  return {averaged_sweep(1.13e-6),
          averaged_sweep(1.11e-6, {.speed_missing = true}),
          averaged_sweep(1.20e-6, {.current_limit = true}),
          averaged_sweep(1.02e-6, {.barely_turning = true}),
          averaged_sweep(1.25e-6, {.negative = true}),
          two_speeds(9.0e-6, electrical),
          two_speeds(9.0e-6, optical, 7),
          two_speeds(9.0e-6, electrical, 7),
          untared_ramp(8.0e-5, 1),
          drifting_plateau(1.4e-4, 2)};
}

}  // namespace kphi::fit
