#include "drivers/sim/script/faults.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>

#include "base/number.hpp"

namespace kphi::sim {
namespace {

constexpr FaultExtent kOnce = FaultExtent::instant, kWindow = FaultExtent::window, kSome = FaultExtent::window_or_count,
                      kOpen = FaultExtent::window_or_forever;
constexpr double kMany = 4294967295.0;

void as_tag(Fault& fault, const FaultParameter<Fault>& parameter, const std::string& word) {
  fault.tag = word;
  const bool good = !word.empty() && std::all_of(word.begin(), word.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
  });
  if (!good)
    throw FaultEntryError(std::string(parameter.name), fmt::format("\"{}\" is not the name of an element", word));
}
void as_address(Fault& fault, const FaultParameter<Fault>& parameter, const std::string& word) {
  fault.address = word;
  in_addr parsed{};
  if (::inet_pton(AF_INET, word.c_str(), &parsed) != 1)
    throw FaultEntryError(std::string(parameter.name), fmt::format("\"{}\" is not an IPv4 address", word));
}
void as_wrong_size(Fault& fault, const FaultParameter<Fault>& parameter, const std::string& text) {
  FaultParameter<Fault>::into<&Fault::size>(fault, parameter, text);
  if (fault.size > 0 && fault.size % 36 == 0 && fault.size <= 1440)
    throw FaultEntryError("size", "whole records are the right size: 36 to 1440 in steps of 36");
}

void as_value(MotorFault& fault, const FaultParameter<MotorFault>&, const std::string& text) {
  if (text == "nan" || text == ".nan") {
    fault.value = std::numeric_limits<double>::quiet_NaN();
  } else if (text == "inf" || text == "-inf") {
    fault.value = std::copysign(std::numeric_limits<double>::infinity(), text == "inf" ? 1.0 : -1.0);
  } else if (text == "denormal") {
    fault.value = std::numeric_limits<float>::denorm_min();
  } else {
    fault.value = fault_number("value", text);
  }
}

void as_bytes(MotorFault& fault, const FaultParameter<MotorFault>&, const std::string& text) {
  std::string digits;
  for (const char c : text) {
    if (c == ' ') continue;
    if (std::isxdigit(static_cast<unsigned char>(c)) == 0)
      throw FaultEntryError("bytes", fmt::format("\"{}\" is not bytes like 55 3B", text));
    digits += c;
  }
  if (digits.empty() || digits.size() % 2 != 0 || digits.size() > 256)
    throw FaultEntryError("bytes", "give 1 to 128 bytes of two hexadecimal digits each");
  for (std::size_t i = 0; i < digits.size(); i += 2)
    fault.bytes.push_back(static_cast<std::uint8_t>(std::stoi(digits.substr(i, 2), nullptr, 16)));
}

/// A fault of replies may concern all entries or one.
std::vector<FaultParameter<MotorFault>> of_replies(std::vector<FaultParameter<MotorFault>> parameters = {}) {
  using F = MotorFault;
  parameters.insert(parameters.end(), {key<&F::p>("p"), key<&F::type>("type", 0, 255), key<&F::sub>("sub", 0, 255)});
  return parameters;
}

}  // namespace

double fault_number(std::string_view key, const std::string& text, const FaultRange& range) {
  std::optional<double> value = parse_finite(text);
  if (text == "true" || text == "false") value = text == "true" ? 1 : 0;
  if (text.starts_with("0x")) value = parse_integer<std::uint32_t>(text.substr(2), 16);
  if (!value) throw FaultEntryError(std::string(key), fmt::format("\"{}\" is not a number", text));
  if (!(*value >= range.low && *value <= range.high))
    throw FaultEntryError(std::string(key), fmt::format("{} is outside {} to {}", *value, range.low, range.high));
  if (range.whole && *value != std::floor(*value))
    throw FaultEntryError(std::string(key), fmt::format("{} is not a whole number", *value));
  return *value;
}

const FaultTable<Fault>& load_cell_faults() {
  using F = Fault;
  using K = FaultKind;
  constexpr auto p = key<&F::p>("p"), delay = key<&F::delay>("delay_s"), jitter = key<&F::jitter>("jitter_s");
  constexpr auto any_delay = required<&F::delay>("delay_s");
  constexpr FaultParameter<F> tag{"tag", as_tag, 0, 0, true}, address{"address", as_address, 0, 0, true};
  const auto size = [](double low, double high) { return required<&F::size>("size", low, high); };
  const auto samples = [](double high) { return required<&F::samples>("samples", 1, high); };
  static const FaultTable<F> all{
      "the load cell",
      {
          {K::loss, "loss", kSome, {p, key<&F::burst>("burst", 1, 1e6)}},
          {K::gilbert,
           "gilbert",
           kSome,
           {required<&F::p_good_bad>("p_good_bad"), required<&F::p_bad_good>("p_bad_good"), key<&F::loss>("loss")}},
          {K::duplicate, "duplicate", kSome, {p, delay}},
          {K::reorder,
           "reorder",
           kSome,
           {p, key<&F::depth>("depth", 1, 1000), key<&F::delay>("delay_s", 0, 3600, "0.01")}},
          {K::delay, "delay", kSome, {any_delay, jitter}},
          {K::jitter, "jitter", kSome, {required<&F::jitter>("mean_s"), p, key<&F::spike>("spike_s")}},
          {K::hold, "hold", kWindow, {}},
          {K::wrong_size,
           "wrong_size",
           kSome,
           {p, {"size", as_wrong_size, 0, 1476, true}, key<&F::replaces>("replaces")}},
          {K::short_block, "short_block", kSome, {p, key<&F::records>("records", 1, 39)}},
          {K::foreign_source, "foreign_source", kSome, {p}},
          {K::lost_start, "lost_start", kSome, {}},
          {K::doubled_start, "doubled_start", kSome, {delay}},
          {K::delayed_start, "delayed_start", kSome, {any_delay}},
          {K::taken_over, "taken_over", kOnce, {key<&F::buffered>("buffered")}},
          {K::restart, "restart", kOnce, {}},
          {K::reboot, "reboot", kOnce, {key<&F::down>("down_s"), key<&F::resume>("resume")}},
          {K::stall, "stall", kWindow, {}},
          {K::ft_jump_back, "ft_jump_back", kOnce, {samples(kMany)}},
          {K::overrun, "overrun", kOnce, {samples(1e6)}},
          {K::wrap, "wrap", kOnce, {samples(kMany)}},
          {K::clock_skew,
           "clock_skew",
           kOpen,
           {required<&F::ppm>("ppm", -1000, 1000), key<&F::wander_ppm>("wander_ppm", 0, 1000),
            key<&F::period>("period_s", 1, 1e6)}},
          {K::status, "status", kOpen, {required<&F::bits>("bits", 1, kMany), key<&F::latched>("latched")}},
          {K::saturation, "saturation", kOpen, {required<&F::axes>("axes", 1, 63)}},
          {K::units,
           "units",
           kOnce,
           {required<&F::force_unit>("force_unit", 1, 6), key<&F::torque_unit>("torque_unit", 1, 6)}},
          {K::rate, "rate", kOnce, {required<&F::rate_hz>("rate_hz", 1, 7000)}},
          {K::zero_drift,
           "zero_drift",
           kOnce,
           {key<&F::axis>("axis", 0, 5), required<&F::amount>("amount", -1000, 1000),
            key<&F::tau>("tau_s", 1e-3, 1e6)}},
          {K::address, "address", kOpen, {address}},
          {K::http_slow, "http_slow", kSome, {any_delay}},
          {K::http_truncated, "http_truncated", kSome, {size(0, 1e6)}},
          {K::http_status, "http_status", kSome, {required<&F::code>("code", 400, 599)}},
          {K::http_oversized, "http_oversized", kSome, {size(1, 1e8)}},
          {K::http_charset, "http_charset", kSome, {key<&F::utf16>("utf16")}},
          {K::http_missing_tag, "http_missing_tag", kSome, {tag}},
          {K::http_duplicate_tag, "http_duplicate_tag", kSome, {tag}},
          {K::http_refused, "http_refused", kWindow, {}},
          {K::tcp_split, "tcp_split", kSome, {size(1, 23), key<&F::delay>("delay_s", 0, 3600, "0.002")}},
          {K::tcp_merged, "tcp_merged", kSome, {any_delay}},
          {K::tcp_short, "tcp_short", kSome, {size(0, 23)}},
      }};
  return all;
}

const FaultTable<MotorFault>& motor_faults() {
  using F = MotorFault;
  using K = MotorFaultKind;
  constexpr auto delay = required<&F::delay>("delay_s");
  constexpr auto volts = required<&F::volts>("volts", 0, 100);
  constexpr FaultParameter<F> value{"value", as_value, 0, 0, true};
  const auto size = [](double low, double high) { return required<&F::size>("size", low, high); };
  static const FaultTable<F> all{
      "the motor",
      {
          {K::flip, "motor_flip", kSome, of_replies({key<&F::bits>("bits", 1, 64)})},
          {K::bad_crc, "motor_bad_crc", kSome, of_replies()},
          {K::drop, "motor_drop", kSome, of_replies()},
          {K::duplicate, "motor_duplicate", kSome, of_replies()},
          {K::reorder, "motor_reorder", kSome, of_replies({key<&F::delay>("delay_s", 0, 3600, "0.01")})},
          {K::truncate, "motor_truncate", kSome, of_replies({size(0, 22)})},
          {K::garbage, "motor_garbage", kSome, of_replies({{"bytes", as_bytes}, key<&F::size>("size", 1, 200, "8")})},
          {K::merge, "motor_merge", kSome, of_replies({delay})},
          {K::split, "motor_split", kSome, of_replies({delay})},
          {K::stall, "motor_stall", kSome, of_replies({size(1, 22), delay})},
          {K::delay, "motor_delay", kSome, of_replies({delay, key<&F::jitter>("jitter_s")})},
          {K::value, "motor_value", kSome, of_replies({value})},
          {K::wrong_length, "motor_wrong_length", kSome, of_replies({size(0, 16)})},
          {K::wrong_id, "motor_wrong_id", kSome, of_replies({required<&F::id>("id", 0, 63)})},
          {K::stuck, "motor_stuck", kSome, of_replies()},
          {K::mute, "motor_mute", kWindow, {}},
          {K::deaf, "motor_deaf", kWindow, {}},
          {K::command_flip, "motor_command_flip", kSome, {key<&F::p>("p")}},
          {K::unplug, "motor_unplug", kWindow, {key<&F::other>("other", 0, 1)}},
          {K::brown_out, "motor_brown_out", kOnce, {key<&F::down>("down_s")}},
          {K::ignore_sets, "motor_ignore_sets", kWindow, {}},
          {K::baud, "motor_baud", kOnce, {key<&F::baud>("baud", 300, 2e6)}},
          {K::redline, "motor_redline", kWindow, {required<&F::speed>("speed_rad_s", 1, 4200)}},
          {K::hot,
           "motor_hot",
           kWindow,
           {key<&F::coil>("coil_celsius", -300, 300), key<&F::controller>("controller_celsius", -300, 300)}},
          {K::over_voltage, "motor_over_voltage", kWindow, {volts}},
          {K::sag, "motor_sag", kWindow, {volts}},
          {K::locked, "motor_locked", kWindow, {}},
      }};
  return all;
}

const FaultTable<SupplyFault>& supply_faults() {
  using F = SupplyFault;
  using K = SupplyFaultKind;
  constexpr auto p = key<&F::p>("p"), size = key<&F::size>("size", 0, 260);
  constexpr auto address = required<&F::address>("register", 0, 65535), value = required<&F::value>("value", 0, 65535);
  static const FaultTable<F> all{
      "the supply",
      {
          {K::bad_crc, "supply_bad_crc", kSome, {p}},
          {K::no_reply, "supply_no_reply", kSome, {p}},
          {K::deaf, "supply_deaf", kSome, {p}},
          {K::truncated, "supply_truncated", kSome, {p, size}},
          {K::dribble, "supply_dribble", kSome, {p, required<&F::delay>("gap_s", 0, 10)}},
          {K::garbage, "supply_garbage", kSome, {p, size}},
          {K::wrong_slave, "supply_wrong_slave", kSome, {p, key<&F::slave>("slave", 0, 255)}},
          {K::wrong_transaction, "supply_wrong_transaction", kSome, {p}},
          {K::echo, "supply_echo", kSome, {p}},
          {K::late, "supply_late", kSome, {p, required<&F::delay>("delay_s")}},
          {K::exception, "supply_exception", kSome, {p, key<&F::code>("code", 1, 11)}},
          {K::ignored_writes, "supply_ignored_writes", kSome, {p}},
          {K::reads_as, "supply_reads_as", kWindow, {address, value}},
          {K::closed, "supply_closed", kWindow, {}},
          {K::trip, "supply_trip", kOnce, {required<&F::code>("code", 1, 5)}},
          {K::panel, "supply_panel", kOnce, {address, value}},
          {K::sag, "supply_sag", kWindow, {required<&F::volts>("volts", 0, 100)}},
      }};
  return all;
}

const FaultTable<UsbFault>& ambient_faults() {
  using F = UsbFault;
  using K = UsbFaultKind;
  constexpr auto address = required<&F::address>("register", 0, 255), value = required<&F::value>("value", 0, 255);
  static const FaultTable<F> all{"the air sensor",
                                 {
                                     {K::unplug, "ambient_unplug", kWindow, {}},
                                     {K::no_reply, "ambient_no_reply", kSome, {}},
                                     {K::late, "ambient_late", kSome, {required<&F::delay>("delay_s")}},
                                     {K::stall, "ambient_stall", kSome, {}},
                                     {K::nack, "ambient_nack", kSome, {}},
                                     {K::busy, "ambient_busy", kSome, {}},
                                     {K::stuck_bus, "ambient_stuck_bus", kSome, {}},
                                     {K::reads_as, "ambient_reads_as", kSome, {address, value}},
                                 }};
  return all;
}

}  // namespace kphi::sim
