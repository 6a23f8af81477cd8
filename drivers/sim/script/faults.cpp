#include "drivers/sim/script/faults.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <boost/algorithm/hex.hpp>
#include <boost/algorithm/string/erase.hpp>
#include <cmath>
#include <optional>
#include <type_traits>

#include "base/number.hpp"

namespace kphi::sim {
namespace {

/// How long a fault of a kind lasts: a moment; a window (for_s); a window or a number of times (count); a window or for
/// ever.
enum Extent : std::uint8_t { kOnce, kWindow, kSome, kOpen };
constexpr double kMany = 4294967295.0;
constexpr double kLatest = 1e6;  // s

[[noreturn]] void refuse(std::string_view key, const std::string& what) {
  throw FaultEntryError(std::string(key), what);
}

/// A key of a kind: how its text becomes a member.
struct FaultKey {
  std::string_view name;
  /// Throws FaultEntryError for an invalid text.
  void (*set)(Fault& fault, const FaultKey& key, const std::string& text);
  double low = 0, high = 0;
  bool required = false;
  const char* usual = nullptr;  ///< when an entry does not say; nullptr: as the member is
};

struct FaultRow {
  FaultKind kind;
  std::string_view name;
  Extent extent;
  std::vector<FaultKey> keys;
};

template <auto Member>
using TypeOf = std::remove_reference_t<decltype(std::declval<Fault&>().*Member)>;
template <auto Member>
constexpr double kUsualMax = std::is_same_v<TypeOf<Member>, Duration> ? 3600 : 1;  ///< an hour, a certainty

/// A member that is a number (an integer takes whole numbers only) or a Duration (the script has seconds).
template <auto Member>
void into(Fault& fault, const FaultKey& key, const std::string& text) {
  using T = TypeOf<Member>;
  const double value = fault_number(key.name, text, key.low, key.high, std::is_integral_v<T>);
  if constexpr (std::is_same_v<T, Duration>) {
    fault.*Member = from_seconds(value);
  } else {
    fault.*Member = static_cast<T>(value);
  }
}

/// An optional key for a member.
template <auto Member>
constexpr FaultKey key(std::string_view name, double low = 0, double high = kUsualMax<Member>,
                       const char* usual = nullptr) {
  return {name, into<Member>, low, high, false, usual};
}
/// A key that an entry must have.
template <auto Member>
constexpr FaultKey required(std::string_view name, double low = 0, double high = kUsualMax<Member>) {
  return {name, into<Member>, low, high, true};
}

void as_tag(Fault& fault, const FaultKey& key, const std::string& word) {
  fault.tag = word;
  if (word.empty() || word.find_first_not_of("0123456789abcdefghijklmnopqrstuvwxyz") != std::string::npos)
    refuse(key.name, fmt::format("\"{}\" is not the name of an element", word));
}
void as_ip(Fault& fault, const FaultKey& key, const std::string& word) {
  fault.ip = word;
  in_addr parsed{};
  if (::inet_pton(AF_INET, word.c_str(), &parsed) != 1)
    refuse(key.name, fmt::format("\"{}\" is not an IPv4 address", word));
}
void as_wrong_size(Fault& fault, const FaultKey& key, const std::string& text) {
  into<&Fault::size>(fault, key, text);
  if (fault.size > 0 && fault.size % 36 == 0 && fault.size <= 1440)
    refuse("size", "size is a multiple of 36 up to 1440, so it is not a wrong size");
}

void as_reading(Fault& fault, const FaultKey&, const std::string& text) {
  if (text == "nan" || text == ".nan") {
    fault.reading = std::numeric_limits<double>::quiet_NaN();
  } else if (text == "inf" || text == "-inf") {
    fault.reading = std::copysign(std::numeric_limits<double>::infinity(), text == "inf" ? 1.0 : -1.0);
  } else if (text == "denormal") {
    fault.reading = std::numeric_limits<float>::denorm_min();
  } else {
    fault.reading = fault_number("value", text);
  }
}

void as_bytes(Fault& fault, const FaultKey&, const std::string& text) {
  try {
    boost::algorithm::unhex(boost::algorithm::erase_all_copy(text, " "), std::back_inserter(fault.bytes));
  } catch (const boost::algorithm::hex_decode_error&) {
    refuse("bytes", fmt::format("\"{}\" is not bytes like 55 3B", text));
  }
  if (fault.bytes.empty() || fault.bytes.size() > 128)
    refuse("bytes", "give 1 to 128 bytes of two hexadecimal digits each");
}

const std::vector<FaultRow>& fault_rows() {
  using F = Fault;
  using K = FaultKind;
  constexpr FaultKey p = key<&F::p>("p"), delay = key<&F::delay>("delay_s"), jitter = key<&F::jitter>("jitter_s"),
                     any_delay = required<&F::delay>("delay_s"), volts = required<&F::volts>("volts", 0, 100);
  constexpr FaultKey tag{"tag", as_tag, 0, 0, true}, ip{"address", as_ip, 0, 0, true},
      reading{"value", as_reading, 0, 0, true};
  constexpr FaultKey byte_at = required<&F::address>("register", 0, 255), byte = required<&F::value>("value", 0, 255),
                     word_at = required<&F::address>("register", 0, 65535),
                     word = required<&F::value>("value", 0, 65535);
  constexpr FaultKey some = key<&F::size>("size", 0, 260, "3");
  const auto size = [](double low, double high) { return required<&F::size>("size", low, high); };
  const auto samples = [](double high) { return required<&F::samples>("samples", 1, high); };
  const auto of_replies = [&](std::vector<FaultKey> keys = {}) {  // of all entries or one
    keys.insert(keys.end(), {p, key<&F::type>("type", 0, 255), key<&F::sub>("sub", 0, 255)});
    return keys;
  };
  static const std::vector<FaultRow> all{
      {K::loss, "loss", kSome, {p, key<&F::burst>("burst", 1, 1e6)}},
      {K::gilbert,
       "gilbert",
       kSome,
       {required<&F::p_good_bad>("p_good_bad"), required<&F::p_bad_good>("p_bad_good"), key<&F::loss>("loss")}},
      {K::duplicate, "duplicate", kSome, {p, delay}},
      {K::reorder, "reorder", kSome, {p, key<&F::depth>("depth", 1, 1000), key<&F::delay>("delay_s", 0, 3600, "0.01")}},
      {K::delay, "delay", kSome, {any_delay, jitter}},
      {K::jitter, "jitter", kSome, {required<&F::jitter>("mean_s"), p, key<&F::spike>("spike_s")}},
      {K::hold, "hold", kWindow, {}},
      {K::wrong_size, "wrong_size", kSome, {p, {"size", as_wrong_size, 0, 1476, true}, key<&F::replaces>("replaces")}},
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
      {K::frozen, "frozen", kOpen, {required<&F::axes>("axes", 1, 63)}},
      {K::units,
       "units",
       kOnce,
       {required<&F::force_unit>("force_unit", 1, 6), key<&F::torque_unit>("torque_unit", 1, 6)}},
      {K::rate, "rate", kOnce, {required<&F::rate_hz>("rate_hz", 1, 7000)}},
      {K::zero_drift,
       "zero_drift",
       kOnce,
       {key<&F::axis>("axis", 0, 5), required<&F::amount>("amount", -1000, 1000), key<&F::tau>("tau_s", 1e-3, 1e6)}},
      {K::address, "address", kOpen, {ip}},
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
      {K::motor_flip, "motor_flip", kSome, of_replies({key<&F::bits>("bits", 1, 64)})},
      {K::motor_bad_crc, "motor_bad_crc", kSome, of_replies()},
      {K::motor_drop, "motor_drop", kSome, of_replies()},
      {K::motor_duplicate, "motor_duplicate", kSome, of_replies()},
      {K::motor_reorder, "motor_reorder", kSome, of_replies({key<&F::delay>("delay_s", 0, 3600, "0.01")})},
      {K::motor_truncate, "motor_truncate", kSome, of_replies({size(0, 22)})},
      {K::motor_garbage, "motor_garbage", kSome, of_replies({{"bytes", as_bytes}, key<&F::size>("size", 1, 200, "8")})},
      {K::motor_merge, "motor_merge", kSome, of_replies({any_delay})},
      {K::motor_split, "motor_split", kSome, of_replies({any_delay})},
      {K::motor_stall, "motor_stall", kSome, of_replies({size(1, 22), any_delay})},
      {K::motor_delay, "motor_delay", kSome, of_replies({any_delay, jitter})},
      {K::motor_value, "motor_value", kSome, of_replies({reading})},
      {K::motor_wrong_length, "motor_wrong_length", kSome, of_replies({size(0, 16)})},
      {K::motor_wrong_id, "motor_wrong_id", kSome, of_replies({required<&F::id>("id", 0, 63)})},
      {K::motor_stuck, "motor_stuck", kSome, of_replies()},
      {K::motor_mute, "motor_mute", kWindow, {}},
      {K::motor_deaf, "motor_deaf", kWindow, {}},
      {K::motor_command_flip, "motor_command_flip", kSome, {p}},
      {K::motor_unplug, "motor_unplug", kWindow, {key<&F::other>("other")}},
      {K::motor_brown_out, "motor_brown_out", kOnce, {key<&F::down>("down_s")}},
      {K::motor_ignore_sets, "motor_ignore_sets", kWindow, {}},
      {K::motor_baud, "motor_baud", kOnce, {key<&F::baud>("baud", 300, 2e6)}},
      {K::motor_redline, "motor_redline", kWindow, {required<&F::speed>("speed_rad_s", 1, 4200)}},
      {K::motor_hot,
       "motor_hot",
       kWindow,
       {key<&F::coil>("coil_celsius", -300, 300), key<&F::controller>("controller_celsius", -300, 300)}},
      {K::motor_over_voltage, "motor_over_voltage", kWindow, {volts}},
      {K::motor_sag, "motor_sag", kWindow, {volts}},
      {K::motor_locked, "motor_locked", kWindow, {}},
      {K::supply_bad_crc, "supply_bad_crc", kSome, {p}},
      {K::supply_no_reply, "supply_no_reply", kSome, {p}},
      {K::supply_deaf, "supply_deaf", kSome, {p}},
      {K::supply_truncated, "supply_truncated", kSome, {p, some}},
      {K::supply_dribble, "supply_dribble", kSome, {p, required<&F::delay>("gap_s", 0, 10)}},
      {K::supply_garbage, "supply_garbage", kSome, {p, some}},
      {K::supply_wrong_slave, "supply_wrong_slave", kSome, {p, key<&F::slave>("slave", 0, 255)}},
      {K::supply_wrong_transaction, "supply_wrong_transaction", kSome, {p}},
      {K::supply_echo, "supply_echo", kSome, {p}},
      {K::supply_late, "supply_late", kSome, {p, any_delay}},
      {K::supply_exception, "supply_exception", kSome, {p, key<&F::code>("code", 1, 11)}},
      {K::supply_ignored_writes, "supply_ignored_writes", kSome, {p}},
      {K::supply_reads_as, "supply_reads_as", kWindow, {word_at, word}},
      {K::supply_closed, "supply_closed", kWindow, {}},
      {K::supply_trip, "supply_trip", kOnce, {required<&F::code>("code", 1, 5)}},
      {K::supply_panel, "supply_panel", kOnce, {word_at, word}},
      {K::supply_key, "supply_key", kOnce, {}},
      {K::supply_keys_free, "supply_keys_free", kWindow, {}},
      {K::supply_sag, "supply_sag", kWindow, {volts}},
      {K::ambient_unplug, "ambient_unplug", kWindow, {}},
      {K::ambient_no_reply, "ambient_no_reply", kSome, {}},
      {K::ambient_late, "ambient_late", kSome, {any_delay}},
      {K::ambient_stall, "ambient_stall", kSome, {}},
      {K::ambient_nack, "ambient_nack", kSome, {}},
      {K::ambient_busy, "ambient_busy", kSome, {}},
      {K::ambient_stuck_bus, "ambient_stuck_bus", kSome, {}},
      {K::ambient_slow_close, "ambient_slow_close", kSome, {any_delay}},
      {K::ambient_warm, "ambient_warm", kWindow, {required<&F::coil>("celsius", -20, 20)}},
      {K::ambient_reads_as, "ambient_reads_as", kSome, {byte_at, byte}},
  };
  return all;
}

/// The device of a kind, by the beginning of its name.
struct FaultyDevice {
  std::string_view prefix, words;
};
constexpr FaultyDevice kFaultyDevices[] = {
    {"motor_", "the motor"}, {"supply_", "the supply"}, {"ambient_", "the air sensor"}, {"", "the load cell"}};

const FaultyDevice& device_of(std::string_view name) {
  return *std::ranges::find_if(kFaultyDevices, [&](const auto& device) { return name.starts_with(device.prefix); });
}

const FaultRow& row_of(const FaultEntry& entry) {
  const auto named = entry.find("kind");
  if (named == entry.end()) refuse("", "no kind given");
  const FaultyDevice& device = device_of(named->second);
  std::vector<std::string_view> known;
  for (const FaultRow& row : fault_rows()) {
    if (row.name == named->second) return row;
    if (&device_of(row.name) == &device) known.push_back(row.name);
  }
  refuse("kind",
         fmt::format("unknown fault \"{}\" of {}; known: {}", named->second, device.words, fmt::join(known, ", ")));
}

std::vector<FaultKey> keys_of(const FaultRow& row) {
  std::vector<FaultKey> all = row.keys;
  all.push_back({"at_s", into<&Fault::at>, 0, kLatest, true});
  if (row.extent != kOnce) all.push_back({"for_s", into<&Fault::lasts>, 1e-6, kLatest});
  if (row.extent == kSome) all.push_back({"count", into<&Fault::count>, 1, 1e9});
  return all;
}

}  // namespace

double fault_number(std::string_view key, const std::string& text, double low, double high, bool whole) {
  std::optional<double> value = parse_finite(text);
  if (text == "true" || text == "false") value = text == "true" ? 1 : 0;
  if (text.starts_with("0x")) value = parse_integer<std::uint32_t>(text.substr(2), 16);
  if (!value) refuse(key, fmt::format("\"{}\" is not a number", text));
  if (!(*value >= low && *value <= high)) refuse(key, fmt::format("{} is outside {} to {}", *value, low, high));
  if (whole && *value != std::floor(*value)) refuse(key, fmt::format("{} is not a whole number", *value));
  return *value;
}

Fault fault_of(const FaultEntry& entry) {
  const FaultRow& row = row_of(entry);
  const std::vector<FaultKey> keys = keys_of(row);
  for (const auto& [name, unused] : entry) {
    const bool known = std::ranges::find(keys, name, &FaultKey::name) != keys.end();
    if (!known && name != "kind") refuse(name, fmt::format("{} has no key \"{}\"", row.name, name));
  }
  const bool ends = entry.contains("for_s"), counts = entry.contains("count");
  if (row.extent == kWindow && !ends) refuse("", fmt::format("{} needs for_s", row.name));
  if (row.extent == kSome && !ends && !counts) refuse("", fmt::format("{} needs for_s or count", row.name));
  Fault fault;
  fault.kind = row.kind;
  for (const FaultKey& key : keys) {
    const auto found = entry.find(std::string(key.name));
    if (found != entry.end()) {
      key.set(fault, key, found->second);
    } else if (key.usual != nullptr) {
      key.set(fault, key, key.usual);
    } else if (key.required) {
      refuse("", fmt::format("{} needs {}", row.name, key.name));
    }
  }
  return fault;
}

std::string_view name_of(FaultKind kind) noexcept {
  const auto row = std::ranges::find(fault_rows(), kind, &FaultRow::kind);
  return row == fault_rows().end() ? "?" : row->name;
}

}  // namespace kphi::sim
