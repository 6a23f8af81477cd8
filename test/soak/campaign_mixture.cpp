#include "test/soak/campaign_mixture.hpp"

#include <fmt/format.h>

#include <array>

#include "test/dice.hpp"

namespace kphi::soak {
namespace {

using test::Dice;

/// What an entry of a script says besides its time. <a~b> is a real number drawn between the two, <a..b> a whole one.
constexpr std::array kCellFaults{
    "for_s: <0.05~1>, kind: loss, p: <0.005~0.2>, burst: <1..3>",
    "for_s: <0.05~1>, kind: gilbert, p_good_bad: <0.001~0.1>, p_bad_good: <0.1~0.9>, loss: <0.2~1>",
    "for_s: <0.05~1>, kind: duplicate, p: <0.01~0.5>, delay_s: <0~0.05>",
    "for_s: <0.05~1>, kind: reorder, p: <0.01~0.2>, depth: 1",
    "for_s: <0.05~1>, kind: delay, delay_s: <0~0.05>, jitter_s: <0~0.02>",
    "for_s: <0.05~1>, kind: jitter, mean_s: <0~0.003>, p: <0~0.05>, spike_s: <0~0.03>",
    "for_s: <0.02~0.8>, kind: hold",
    "for_s: <0.05~1>, kind: wrong_size, p: <0.01~0.3>, size: <37..71>, replaces: <0..1>",
    "for_s: <0.05~1>, kind: foreign_source, p: <0.01~0.5>",
    "count: 1, for_s: 20, kind: lost_start",
    "count: 1, for_s: 20, kind: doubled_start, delay_s: <0~0.05>",
    "count: 1, for_s: 20, kind: delayed_start, delay_s: <0~0.05>",
    "kind: taken_over",
    "kind: restart",
    "kind: reboot, down_s: <0~1.5>, resume: <0..1>",
    "for_s: <0.01~0.6>, kind: stall",
    "for_s: <0.07~0.6>, kind: frozen, axes: <1..63>",
    "kind: ft_jump_back, samples: <1000..5000>",
    "for_s: <0.05~1>, kind: short_block, p: <0.01~0.3>, records: 1",
    "for_s: <0.1~1>, kind: address, address: 10.0.0.9",
    "kind: rate, rate_hz: <100..7000>",
    "kind: overrun, samples: <7..3000>",
    "kind: wrap, samples: <1000..20000>",
    "for_s: 60, kind: clock_skew, ppm: <-100~100>, wander_ppm: <0~5>",
    "for_s: <0.02~0.3>, kind: status, bits: 0x80100000",
    "kind: status, bits: 0x88000000",
    "for_s: <0.02~0.5>, kind: status, bits: 0x80000004",
    "for_s: <0.0002~0.02>, kind: status, bits: 0x90000000, latched: <0..1>",
    "kind: status, bits: 0x80010000",
    "for_s: <0.02~0.3>, kind: saturation, axes: <1..7>",
    "kind: units, force_unit: <1..6>",
    "kind: zero_drift, amount: <-1~1>, tau_s: <0.01~5>",
    "count: <1..3>, for_s: 20, kind: http_slow, delay_s: <0~7>",
    "count: <1..3>, for_s: 20, kind: http_truncated, size: <0..3000>",
    "count: <1..3>, for_s: 20, kind: http_status, code: <400..599>",
    "count: <1..3>, for_s: 20, kind: http_oversized, size: <10000..3000000>",
    "count: <1..3>, for_s: 20, kind: http_charset, utf16: <0..1>",
    "count: <1..3>, for_s: 20, kind: http_missing_tag, tag: cfgcpf",
    "count: <1..3>, for_s: 20, kind: http_duplicate_tag, tag: comrdtrate",
    "for_s: <0.1~2>, kind: http_refused",
    "for_s: 1, kind: tcp_split, size: <1..23>",
    "for_s: 1, kind: tcp_merged, delay_s: <0~0.1>",
    "count: 1, for_s: 1, kind: tcp_short, size: <0..23>",
};

constexpr std::array kMotorFaults{
    "for_s: <0.05~1>, kind: motor_flip, p: <0.01~0.3>, bits: <1..3>",
    "for_s: <0.05~1>, kind: motor_bad_crc, p: <0.01~0.3>",
    "for_s: <0.05~1>, kind: motor_drop, p: <0.01~0.5>",
    "for_s: <0.05~1>, kind: motor_duplicate, p: <0.01~0.5>",
    "for_s: <0.05~1>, kind: motor_reorder, p: <0.01~0.3>, delay_s: <0~0.02>",
    "for_s: <0.05~1>, kind: motor_truncate, p: <0.01~0.3>, size: <0..9>",
    "for_s: <0.05~1>, kind: motor_garbage, p: <0.01~0.5>, bytes: 55 3B 32",
    "for_s: <0.05~1>, kind: motor_garbage, p: <0.01~0.5>, size: <1..200>",
    "for_s: <0.05~1>, kind: motor_merge, p: <0.1~1>, delay_s: <0.001~0.02>",
    "for_s: <0.05~1>, kind: motor_split, p: <0.1~1>, delay_s: <0~0.001>",
    "for_s: <0.05~1>, kind: motor_stall, p: <0.01~0.3>, size: <1..9>, delay_s: <0~0.05>",
    "for_s: <0.05~1>, kind: motor_delay, p: <0.1~1>, delay_s: <0~0.03>, jitter_s: <0~0.02>",
    "for_s: <0.05~1>, kind: motor_value, p: <0.01~0.3>, value: nan",
    "for_s: <0.05~1>, kind: motor_value, p: <0.01~0.3>, value: inf",
    "for_s: <0.05~1>, kind: motor_wrong_length, p: <0.01~0.3>, size: <5..9>",
    "for_s: <0.05~1>, kind: motor_wrong_id, p: <0.01~0.5>, id: <1..63>",
    "for_s: <0.05~1>, kind: motor_stuck",
    "for_s: <0.05~1>, kind: motor_stuck, type: 50, sub: 13",
    "for_s: <0.02~1>, kind: motor_mute",
    "for_s: <0.02~1>, kind: motor_deaf",
    "for_s: <0.05~1>, kind: motor_command_flip, p: <0.001~0.02>",
    "for_s: <0.1~1>, kind: motor_unplug, other: <0..1>",
    "kind: motor_brown_out, down_s: <0~0.5>",
    "for_s: <0.1~1>, kind: motor_ignore_sets",
    "kind: motor_baud",
    "for_s: <0.1~1>, kind: motor_redline, speed_rad_s: <200~1500>",
    "for_s: <0.1~1>, kind: motor_hot, coil_celsius: <20~120>",
    "for_s: <0.1~1>, kind: motor_over_voltage, volts: <0.5~20>",
    "for_s: <0.1~1>, kind: motor_sag, volts: <0.5~8>",
    "for_s: <0.1~1>, kind: motor_locked",
};

constexpr std::array kSupplyFaults{
    "kind: supply_trip, code: <1..5>",
    "kind: supply_panel, register: 8, value: <900..1400>",
    "for_s: <0.1~2>, kind: supply_sag, volts: <0.1~8>",
    "for_s: <0.05~3>, kind: supply_no_reply, p: <0.1~1>",
    "for_s: <0.05~3>, kind: supply_deaf, p: <0.1~1>",
    "for_s: <0.05~3>, kind: supply_bad_crc, p: <0.1~1>",
    "for_s: <0.05~3>, kind: supply_truncated, p: <0.1~1>, size: <0..20>",
    "for_s: <0.05~3>, kind: supply_garbage, p: <0.1~1>, size: <1..20>",
    "for_s: <0.05~3>, kind: supply_wrong_slave, p: <0.1~1>, slave: 7",
    "for_s: <0.05~3>, kind: supply_wrong_transaction, p: <0.1~1>",
    "for_s: <0.05~3>, kind: supply_echo, p: <0.1~1>",
    "for_s: <0.05~3>, kind: supply_exception, p: <0.1~1>, code: <1..11>",
    "for_s: <0.05~3>, kind: supply_late, p: <0.1~1>, delay_s: <0~1>",
    "for_s: <0.05~3>, kind: supply_dribble, p: <0.1~1>, gap_s: <0~0.02>",
    "for_s: <0.05~3>, kind: supply_closed",
};

/// Of the sensor of the air; what of its faults concerns a bridge and its bus.
constexpr std::array kAirFaults{
    "for_s: <1~20>, kind: ambient_unplug",
    "count: <1..9>, for_s: 30, kind: ambient_no_reply",
    "count: <1..9>, for_s: 30, kind: ambient_late, delay_s: <0~3>",
    "count: <1..9>, for_s: 30, kind: ambient_stall",
    "count: <1..9>, for_s: 30, kind: ambient_nack",
    "count: <1..9>, for_s: 30, kind: ambient_busy",
    "count: <1..9>, for_s: 30, kind: ambient_stuck_bus",
};

constexpr std::array kPropellers{
    "id: 5x2, name: 5-inch two-blade, diameter_in: 5, blades: 2",
    "id: 5x3, name: 5-inch three-blade, diameter_in: 5, blades: 3",
    "id: 6x2, name: 6-inch two-blade, diameter_in: 6, blades: 2",
    "id: 6x3, name: 6-inch three-blade, diameter_in: 6, blades: 3",
};
constexpr std::array kOcclusions{0, 45, 90, 180, 270};

/// "<a~b>" or "<a..b>" without its brackets.
std::string drawn(std::string_view range, Dice& dice) {
  const auto number = [](std::string_view text) { return std::stod(std::string(text)); };
  if (const auto at = range.find(".."); at != std::string_view::npos) {
    return fmt::format("{}", dice.whole(static_cast<int>(number(range.substr(0, at))),
                                        static_cast<int>(number(range.substr(at + 2)))));
  }
  const auto at = range.find('~');
  return fmt::format("{:.4f}", dice.real(number(range.substr(0, at)), number(range.substr(at + 1))));
}

std::string filled_in(std::string_view pattern, Dice& dice) {
  std::string out;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    if (pattern[i] != '<') {
      out += pattern[i];
      continue;
    }
    const std::size_t end = pattern.find('>', i);
    out += drawn(pattern.substr(i + 1, end - i - 1), dice);
    i = end;
  }
  return out;
}

template <std::size_t N>
std::string entry(const std::array<const char*, N>& patterns, double until_s, Dice& dice) {
  const double at = dice.once_in(10) ? 0.0 : dice.real(0, until_s);
  return fmt::format("  - {{at_s: {:.4f}, {}}}\n", at, filled_in(dice.one_of(patterns), dice));
}

/// What a bench has besides a load cell and a motor.
struct Devices {
  bool supply, sensor;
};

struct Shape {
  int first_deg, second_deg;
  bool box_bias;
  double dwell_s, zero_s;
  /// About, of bench time.
  [[nodiscard]] double seconds() const { return 1 + 4 * (3 * dwell_s + (box_bias ? 4 : 2) * zero_s + 3.5); }
};

Shape shape_of(Dice& dice) {
  const int first = dice.whole(0, 4);
  const int second = (first + dice.whole(1, 4)) % 5;
  return {kOcclusions[static_cast<std::size_t>(first)], kOcclusions[static_cast<std::size_t>(second)], dice.once_in(8),
          dice.real(0.5, 0.7), dice.real(0.3, 0.5)};
}

std::string campaign_of(const Shape& shape, bool powered, Dice& dice) {
  double low = dice.real(3000, 9000), high = dice.real(12000, 15000);
  if (!powered && dice.once_in(4)) std::swap(low, high);  // what a ramp down feeds back trips a supply
  return fmt::format(
      "format: kphi-campaign/1\nname: soak\npropeller: {{{}}}\nocclusions_deg: [{}, {}]\nrepetitions: 2\n"
      "profile: {{steps: 3, dwell_s: {:.3f}, first_rpm: {:.0f}, last_rpm: {:.0f}}}\n"
      "zero_s: {:.3f}\nminimum_discard_s: 0.3\nsupply_v: 12.0\nbox_bias: {}\n"
      "limits: {{speed_max_rpm: 19100, thrust_max_n: 20, supply_current_max_a: 35, coil_temperature_max_degc: 110}}\n",
      dice.one_of(kPropellers), shape.first_deg, shape.second_deg, shape.dwell_s, low, high, shape.zero_s,
      shape.box_bias);
}

std::string bench_of(const Devices& devices, Dice& dice) {
  constexpr std::array kRates{700, 1000, 1000, 1000, 1750, 1750, 3500};
  const int rate = dice.one_of(kRates);
  constexpr std::array kRecords{1, 5, 10, 20};
  const char* supply =
      "supply: {uri: \"modbus-rtu:/dev/null\", voltage_v: 12, current_limit_a: 50, over_voltage_v: 13.5, "
      "over_current_a: 60}\n";
  return fmt::format(
      "format: kphi-bench/1\nname: soak\n"
      "netbox: {{host: 127.0.0.1, rdt_port: 49152, http_port: 8049, rate_hz: {}, records_per_datagram: {}}}\n"
      "iq: {{device: /dev/null, baud: 921600, module_id: 0, spin: {:+}, telemetry_hz: {}, speed_max_rpm: 19300}}\n"
      "thrust_axis: \"+Fz\"\n{}{}",
      rate, dice.one_of(kRecords), dice.once_in(2) ? 1 : -1, dice.one_of(std::array{100, 200}),
      devices.supply ? supply : "", devices.sensor ? "ambient: usb:04d8:00dd\n" : "");
}

std::string faults_of(const Devices& devices, double until_s, Dice& dice) {
  const int number = dice.once_in(6) ? 0 : dice.whole(1, 4);
  std::string faults = "format: kphi-faults/1\nfaults:\n";
  if (number == 0) return faults + "  []\n";
  for (int i = 0; i < number; ++i) {
    const int device = dice.whole(1, 8);
    if (device == 1 && devices.supply) {
      faults += entry(kSupplyFaults, until_s, dice);
    } else if (device == 2 && devices.sensor) {
      faults += entry(kAirFaults, until_s, dice);
    } else {
      faults += dice.once_in(2) ? entry(kCellFaults, until_s, dice) : entry(kMotorFaults, until_s, dice);
    }
  }
  return faults;
}

void add_operator(Mixture& mixture, const Shape& shape, Dice& dice) {
  const auto slip = [&] {
    return dice.once_in(10) ? fmt::format("{}\n", dice.one_of(std::array{"", "9O", "360", "-1"})) : "";
  };
  const std::string first = slip() + fmt::format("{}\n", shape.first_deg);
  const std::string second = slip() + fmt::format("{}\n", shape.second_deg);
  mixture.answers = first + second;
  if (dice.once_in(25)) {
    mixture.answers = dice.one_of(std::array<std::string, 4>{"q\n", "", first + "q\n", first});
    mixture.answers_are_good = false;
  } else if (dice.once_in(25)) {
    mixture.mounted_instead_deg = dice.one_of(kOcclusions);
  }
}

void add_ends(Mixture& mixture, double until_s, Dice& dice) {
  if (dice.once_in(12)) {
    mixture.disk = DiskRefusal{static_cast<std::uint64_t>(dice.whole(1, 1500)),
                               dice.once_in(3) ? static_cast<std::uint64_t>(dice.whole(1, 20)) : 0};
  }
  if (dice.once_in(20)) mixture.interrupt = from_seconds(dice.real(0, until_s));
  if (!dice.once_in(5)) return;
  Kill kill;
  kill.at = dice.one_of(
      std::array{Kill::At::step, Kill::At::step, Kill::At::file_operation, Kill::At::file_operation, Kill::At::prompt});
  kill.number = static_cast<std::uint64_t>(kill.at == Kill::At::step             ? dice.whole(1, 25'000)
                                           : kill.at == Kill::At::file_operation ? dice.whole(1, 1500)
                                                                                 : dice.whole(1, 2));
  mixture.kill = kill;
}

/// Drawn last, so that a seed stays what it was.
void tear_a_write(Mixture& mixture, Dice& dice) {
  if (mixture.kill && mixture.kill->at == Kill::At::file_operation && dice.once_in(2))
    mixture.kill->at = Kill::At::write;
}

void add_sleep(Mixture& mixture, Dice& dice) {
  if (dice.once_in(12))
    mixture.sleep = HostSleep{from_seconds(dice.real(0, mixture.lasts_s)),
                              from_seconds(dice.one_of(std::array{0.1, 0.2, 0.4, 1.0, 5.0}))};
}

}  // namespace

bool Mixture::is_clean() const {
  return faults.find("kind") == std::string::npos && answers_are_good && !disk && !kill && !interrupt && !sleep;
}

Mixture draw(std::uint64_t seed) {
  Dice dice(seed);
  Mixture mixture;
  mixture.seed = seed;
  const Shape shape = shape_of(dice);
  const Devices devices{dice.once_in(2), dice.once_in(3)};
  mixture.campaign = campaign_of(shape, devices.supply, dice);
  mixture.bench = bench_of(devices, dice);
  mixture.lasts_s = shape.seconds();
  mixture.faults = faults_of(devices, mixture.lasts_s, dice);
  add_operator(mixture, shape, dice);
  add_ends(mixture, mixture.lasts_s, dice);
  tear_a_write(mixture, dice);
  add_sleep(mixture, dice);
  mixture.absence = draw_absence(seed);
  return mixture;
}

Mixture draw_resumed(const Mixture& former) {
  Mixture mixture = former;
  ++mixture.life;
  Dice dice(former.seed + (static_cast<std::uint64_t>(mixture.life) << 40));
  mixture.answers.clear();
  mixture.answers_are_good = !dice.once_in(25);
  mixture.mounted_instead_deg.reset();
  mixture.disk.reset();
  mixture.kill.reset();
  mixture.interrupt.reset();
  mixture.sleep.reset();
  mixture.absence.reset();
  mixture.faults_are_others = !dice.once_in(3);
  mixture.accepts_changes = mixture.life > 2 || !dice.once_in(10);
  if (mixture.faults_are_others) {
    const auto has = [&](const char* device) { return former.bench.find(device) != std::string::npos; };
    mixture.faults = faults_of({has("supply: "), has("ambient: ")}, mixture.lasts_s, dice);
  }
  add_ends(mixture, mixture.lasts_s, dice);
  tear_a_write(mixture, dice);
  add_sleep(mixture, dice);
  return mixture;
}

std::string words(const Mixture& mixture) {
  std::string out = fmt::format("# seed {}, life {}\n{}", mixture.seed, mixture.life, mixture.faults);
  const auto add = [&out](const std::string& title, const std::string& text) {
    out += "# " + title + ":\n";
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      out += "#   " + text.substr(at, end - at) + "\n";
      at = end + 1;
    }
  };
  add("campaign", mixture.campaign);
  add("bench", mixture.bench);
  if (mixture.life == 1) add("the operator types, then end of file", mixture.answers);
  if (mixture.life > 1)
    out += fmt::format("# resumed{}{}; the operator {}\n", mixture.faults_are_others ? " with other faults" : "",
                       mixture.accepts_changes ? " and --accept-changes" : "",
                       mixture.answers_are_good ? "types what he is asked for" : "is not there");
  if (mixture.mounted_instead_deg)
    out += fmt::format("# what is truly mounted the second time: {} deg\n", *mixture.mounted_instead_deg);
  if (mixture.disk)
    out += fmt::format("# the disk refuses from operation {} on{}\n", mixture.disk->from,
                       mixture.disk->operations == 0 ? "" : fmt::format(", {} of them", mixture.disk->operations));
  if (mixture.absence) add("afterwards a stream with", mixture.absence->faults);
  if (mixture.interrupt) out += fmt::format("# Ctrl-C at {:.4f} s\n", to_seconds(*mixture.interrupt));
  if (mixture.sleep)
    out += fmt::format("# the computer sleeps at {:.4f} s for {:g} s\n", to_seconds(mixture.sleep->at),
                       to_seconds(mixture.sleep->lasts));
  if (mixture.kill)
    out += fmt::format("# killed at {} {}\n",
                       std::array{"step of time", "file operation", "prompt",
                                  "a write after file operation"}[static_cast<std::size_t>(mixture.kill->at)],
                       mixture.kill->number);
  return out;
}

}  // namespace kphi::soak
