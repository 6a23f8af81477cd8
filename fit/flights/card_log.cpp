// The log that a Crazyflie writes to its card: a description of each kind of record, records, a CRC-32 of all before
// it.
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <map>
#include <optional>

#include "base/error.hpp"
#include "base/number.hpp"
#include "base/text.hpp"
#include "compensation/units.hpp"
#include "fit/flights/flight_series.hpp"
#include "fit/flights/raw_number.hpp"

namespace kphi::fit {
namespace {

constexpr double kGravity = 9.80665;  // m/s² of "g" (CGPM 1901)
constexpr std::size_t kRotors = 4;
constexpr std::size_t kMostVariables = 100'000;

struct Variable {
  std::size_t offset = 0;
  const RawType* type = nullptr;
  std::size_t series = 0;
};

struct RecordKind {
  std::size_t bytes = 0;
  std::vector<Variable> variables;  ///< those that are read
};

/// Body axes of a Crazyflie are ours.
std::vector<FlightSource> sources_of_crazyflie() {
  using Q = FlightQuantity;
  auto sources = axes(Q::specific_force, {"acc.x", "acc.y", "acc.z"}, kGravity);
  std::ranges::copy(axes(Q::angular_rate, {"gyro.x", "gyro.y", "gyro.z"}, kPi / 180), std::back_inserter(sources));
  for (std::size_t i = 0; i < kRotors; ++i) {
    sources.push_back({Q::rotor_speed, i, fmt::format("rpm.m{}", i + 1), kRadPerSecPerRpm});
    sources.push_back({Q::command, i, fmt::format("motor.m{}", i + 1), 1 / 65535.0});
  }
  sources.push_back({Q::voltage, 0, "pm.vbat"});
  sources.push_back({Q::height, 0, "range.zrange", 1e-3});
  sources.push_back({Q::height, 0, "stateEstimate.z"});
  sources.push_back({Q::climb, 0, "stateEstimate.vz"});
  return sources;
}

class CardLogReader {
 public:
  CardLogReader(std::string_view bytes, const std::string& path, const FlightLayout& layout)
      : bytes_(bytes), rest_(bytes.substr(1)), path_(path), series_(path, sources_of_crazyflie(), layout) {}

  void read(FlightLog& log) {
    version_ = need<std::uint16_t>();
    if (version_ != 1 && version_ != 2)
      throw ConfigurationError(
          fmt::format("{}: a Crazyflie card log of version {}; kphi reads 1 and 2", path_, version_));
    const auto kinds = need<std::uint16_t>();
    for (std::size_t i = 0; i < kinds; ++i) read_kind();
    check_sum(log);
    while (rest_.size() > kCrcBytes && read_record()) {
    }
    if (rest_.size() > kCrcBytes)
      log.findings.push_back({Severity::warning,
                              fmt::format("{} {} byte {}", bytes_in_words(rest_.size()),
                                          cut_ ? "are left of a record that was cut, from" : "cannot be read, from",
                                          bytes_.size() - rest_.size() + 1),
                              cut_ ? "" : "copy the log from the card again"});
    series_.move_to(log);
  }

 private:
  static constexpr std::size_t kCrcBytes = 4;

  [[noreturn]] void refuse_end() const {
    throw ConfigurationError(path_ + ": ends in the description of a Crazyflie card log");
  }

  template <class T>
  T need() {
    const auto value = take_raw<T>(rest_);
    if (!value) refuse_end();
    return *value;
  }

  std::string_view name() {
    const std::size_t end = rest_.find('\0');
    if (end == std::string_view::npos) refuse_end();
    const std::string_view text = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return text;
  }

  /// Number of the kind, its name, and each variable as "name(letter)".
  void read_kind() {
    const auto id = need<std::uint16_t>();
    static_cast<void>(name());
    const auto count = need<std::uint16_t>();
    if ((variables_ += count) > kMostVariables)
      throw ConfigurationError(
          fmt::format("{}: more than {} variables are described: damaged, or not a log", path_, kMostVariables));
    RecordKind kind;
    for (std::size_t i = 0; i < count; ++i) {
      const std::string_view text = name();
      const std::size_t open = text.size() < 3 ? std::string_view::npos : text.size() - 3;
      const auto type = open == std::string_view::npos ? std::end(kRawTypes)
                                                       : std::ranges::find(kRawTypes, text[open + 1], &RawType::letter);
      if (type == std::end(kRawTypes) || text[open] != '(' || text.back() != ')')
        throw ConfigurationError(
            fmt::format("{}: variable {} has no type that a Crazyflie card log knows", path_, in_quotes(text)));
      const auto found = std::ranges::find_if(
          series_.all(), [&](const FlightSeries& series) { return series.source.series == text.substr(0, open); });
      if (found != series_.all().end())
        kind.variables.push_back({kind.bytes, type, static_cast<std::size_t>(found - series_.all().begin())});
      kind.bytes += type->bytes;
    }
    kinds_.try_emplace(id, std::move(kind));
  }

  void check_sum(FlightLog& log) const {
    if (bytes_.size() < kCrcBytes + 1) return;
    const std::string_view summed = bytes_.substr(0, bytes_.size() - kCrcBytes);
    const auto crc = ::crc32_z(0, reinterpret_cast<const Bytef*>(summed.data()), summed.size());
    if (crc != raw<std::uint32_t>(bytes_.substr(summed.size())))
      log.findings.push_back({Severity::warning, "the CRC-32 at the log's end is not that of its bytes: cut or damaged",
                              "copy the log from the card again"});
  }

  /// False: the next bytes are not a record.
  bool read_record() {
    std::string_view rest = rest_.substr(0, rest_.size() - kCrcBytes);
    const auto id = take_raw<std::uint16_t>(rest);
    const auto kind = id ? kinds_.find(*id) : kinds_.end();
    const auto ms = version_ == 1 ? take_raw<std::uint32_t>(rest) : std::optional<std::uint32_t>();
    const auto us = version_ == 2 ? take_raw<std::uint64_t>(rest) : std::optional<std::uint64_t>();
    cut_ = !id || (!ms && !us) || (kind != kinds_.end() && rest.size() < kind->second.bytes);
    if (kind == kinds_.end() || cut_) return false;
    const double stamp_s = ms ? 1e-3 * *ms : 1e-6 * static_cast<double>(*us);
    if (!start_s_) start_s_ = stamp_s;
    for (const Variable& variable : kind->second.variables)
      series_.add(variable.series, stamp_s - *start_s_, variable.type->read(rest.substr(variable.offset)));
    rest.remove_prefix(kind->second.bytes);
    rest_.remove_prefix(rest_.size() - kCrcBytes - rest.size());
    return true;
  }

  std::string_view bytes_, rest_;
  const std::string& path_;
  SeriesSet series_;
  unsigned version_ = 0;
  std::size_t variables_ = 0;
  std::map<std::uint16_t, RecordKind> kinds_;
  std::optional<double> start_s_;
  bool cut_ = false;
};

}  // namespace

void read_card_log(std::string_view bytes, const std::string& path, const FlightLayout& layout, FlightLog& log) {
  log.format = "Crazyflie card log";
  CardLogReader(bytes, path, layout).read(log);
}

}  // namespace kphi::fit
