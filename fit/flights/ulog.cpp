// PX4's ULog by its public description (docs.px4.io, "ULog File Format").
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "base/error.hpp"
#include "base/number.hpp"
#include "base/text.hpp"
#include "compensation/units.hpp"
#include "fit/flights/flight_series.hpp"
#include "fit/flights/raw_number.hpp"
#include "fit/flights/ulog_types.hpp"

namespace kphi::fit {
namespace {

constexpr std::size_t kUlogHeader = 16, kUlogMessageHeader = 3;
constexpr std::size_t kNoInstance = 256;
constexpr std::string_view kSync("\x2F\x73\x13\x20\x25\x0C\xBB\x12", 8);
constexpr double kFirstMotor = 101;  // of actuator_function
constexpr std::size_t kMotors = 12, kEscs = 8;

/// One number that is read from each message of a subscription.
struct SeriesPlace {
  std::size_t series = 0;
  RawPlace value;
  std::optional<RawPlace> time, valid, motor;
};

struct Subscription {
  std::size_t least = 0, most = 0;  // bytes
  RawPlace timestamp;
  std::vector<SeriesPlace> readings;
};

/// "battery_status:1.voltage_v" → topic, instance, field
struct SeriesName {
  std::string_view topic, field;
  std::size_t instance = 0;
  explicit SeriesName(std::string_view series) {
    const std::size_t dot = std::min(series.find('.'), series.size());
    topic = series.substr(0, dot);
    field = series.substr(std::min(dot + 1, series.size()));
    const std::size_t colon = topic.find(':');
    if (colon == std::string_view::npos) return;
    instance = parse_integer<std::size_t>(topic.substr(colon + 1)).value_or(kNoInstance);
    topic = topic.substr(0, colon);
  }
};

/// Body axes of PX4 are forward, right, down.
std::vector<FlightSource> sources_of_px4() {
  using Q = FlightQuantity;
  std::vector<FlightSource> sources;
  const auto vector = [&](Q quantity, const std::string& field) {
    std::ranges::copy(axes(quantity, {field + "[0]", field + "[1]", field + "[2]"}, 1, -1),
                      std::back_inserter(sources));
  };
  vector(Q::specific_force, "vehicle_acceleration.xyz");
  vector(Q::specific_force, "sensor_combined.accelerometer_m_s2");
  vector(Q::angular_rate, "vehicle_angular_velocity.xyz");
  vector(Q::angular_rate, "sensor_combined.gyro_rad");
  vector(Q::angular_acceleration, "vehicle_angular_velocity.xyz_derivative");
  vector(Q::angular_acceleration, "vehicle_angular_acceleration.xyz");
  for (std::size_t i = 0; i < kEscs; ++i)
    sources.push_back({Q::rotor_speed, i, fmt::format("esc_status.esc[{}].esc_rpm", i), kRadPerSecPerRpm});
  for (std::size_t i = 0; i < kMotors; ++i)
    sources.push_back({Q::command, i, fmt::format("actuator_motors.control[{}]", i)});
  sources.push_back({Q::voltage, 0, "battery_status.voltage_v"});
  sources.push_back({Q::density, 0, "vehicle_air_data.rho"});
  sources.push_back({Q::height, 0, "vehicle_local_position.dist_bottom"});
  sources.push_back({Q::height, 0, "vehicle_local_position.z", -1});
  sources.push_back({Q::climb, 0, "vehicle_local_position.vz", -1});
  return sources;
}

class UlogReader {
 public:
  UlogReader(std::string_view bytes, const std::string& path, const FlightLayout& layout)
      : bytes_(bytes),
        path_(path),
        types_(path),
        series_(path, sources_of_px4(), layout),
        rotors_told_(layout.has(FlightQuantity::rotor_speed)) {}

  void read(FlightLog& log) {
    if (bytes_.size() < kUlogHeader) throw ConfigurationError(path_ + ": ends in the header of a ULog");
    start_us_ = raw<std::uint64_t>(bytes_.substr(8));
    read_flags();
    // What was appended begins where the log ended, perhaps in the middle of a message.
    std::size_t begin = kUlogHeader;
    for (const std::size_t end : ends_) {
      read_messages(begin, end);
      begin = end;
    }
    series_.move_to(log);
    describe(log);
  }

 private:
  struct Message {
    char type = 0;
    std::string_view payload;
  };

  void read_flags() {
    const auto first = message_at(kUlogHeader, bytes_.size());
    if (first && first->type == 'B' && first->payload.size() >= 40) {
      std::string_view incompatible = first->payload.substr(8, 8);
      const bool appended = (incompatible[0] & 1) != 0;
      for (std::size_t i = 0; i < 8; ++i)
        if ((incompatible[i] & (i == 0 ? ~1 : ~0)) != 0)
          throw ConfigurationError(
              path_ + ": a ULog with features that kphi does not know (incompatible flag bits); update kphi");
      for (std::size_t i = 0; appended && i < 3; ++i) {
        const auto offset = raw<std::uint64_t>(first->payload.substr(16 + 8 * i));
        if (offset > (ends_.empty() ? kUlogHeader : ends_.back()) && offset < bytes_.size()) ends_.push_back(offset);
      }
    }
    ends_.push_back(bytes_.size());
  }

  /// nullopt: the bytes up to `end` do not hold it.
  [[nodiscard]] std::optional<Message> message_at(std::size_t at, std::size_t end) const {
    if (end - at < kUlogMessageHeader) return std::nullopt;
    const std::size_t size = raw<std::uint16_t>(bytes_.substr(at));
    if (end - at - kUlogMessageHeader < size) return std::nullopt;
    return Message{bytes_[at + 2], bytes_.substr(at + kUlogMessageHeader, size)};
  }

  void read_messages(std::size_t at, std::size_t end) {
    while (at < end) {
      const auto message = message_at(at, end);
      if (message && take(*message)) {
        at += kUlogMessageHeader + message->payload.size();
        continue;
      }
      // Damaged here, or the last message was cut: the next mark of synchronisation tells.
      const std::size_t sync = bytes_.substr(0, end).find(kSync, at);
      if (sync != std::string_view::npos) {
        ++damaged_, damaged_bytes_ += sync - at;
        at = sync + kSync.size();
      } else if (!message) {
        cut_ = cut_ || end == bytes_.size();
        return;
      } else {
        ++damaged_, damaged_bytes_ += end - at;
        return;
      }
    }
  }

  /// False: no log has this.
  bool take(const Message& message) {
    if (message.payload.empty()) return false;
    switch (message.type) {
      case 'F':
        types_.define(message.payload);
        return true;
      case 'A':
        return subscribe(message.payload);
      case 'D':
        return take_data(message.payload);
      case 'O':
        if (message.payload.size() >= 2) note_dropout(raw<std::uint16_t>(message.payload));
        return true;
      default:  // of later versions of the format, too
        return message.type >= 'A' && message.type <= 'Z';
    }
  }

  bool subscribe(std::string_view payload) {
    if (payload.size() < 4) return false;
    const std::size_t instance = static_cast<std::uint8_t>(payload[0]);
    const auto id = raw<std::uint16_t>(payload.substr(1));
    const std::string_view topic = payload.substr(3);
    const auto [place, is_new] = subscriptions_.try_emplace(id);
    if (!is_new || !types_.has(topic)) return true;
    Subscription& subscription = place->second;
    for (std::size_t i = 0; i < series_.all().size(); ++i) {
      const SeriesName name(series_.all()[i].source.series);
      if (name.topic != topic || name.instance != instance || !read_series_.insert(i).second) continue;
      if (const auto reading = reading_of(i, name)) subscription.readings.push_back(*reading);
    }
    if (subscription.readings.empty()) return true;
    const auto timestamp = types_.find(topic, "timestamp");
    if (!timestamp || timestamp->type->name != "uint64_t")
      throw ConfigurationError(
          fmt::format("{}: topic {} has no timestamp of 64 bits, as PX4 writes them", path_, in_quotes(topic)));
    subscription.timestamp = *timestamp;
    std::tie(subscription.least, subscription.most) = types_.logged_bytes(topic);
    return true;
  }

  std::optional<SeriesPlace> reading_of(std::size_t series, const SeriesName& name) {
    const auto value = types_.find(name.topic, name.field);
    if (!value) return std::nullopt;
    const std::size_t dot = name.field.rfind('.');
    const std::string around(dot == std::string_view::npos ? "" : name.field.substr(0, dot + 1));
    SeriesPlace reading{series, *value, {}, types_.find(name.topic, std::string(name.field) + "_valid"), {}};
    const FlightQuantity quantity = series_.all()[series].source.quantity;
    if (!around.empty()) reading.time = types_.find(name.topic, around + "timestamp");
    if (is_sensor(quantity)) reading.time = types_.find(name.topic, around + "timestamp_sample");
    if (!rotors_told_ && quantity == FlightQuantity::rotor_speed)
      reading.motor = types_.find(name.topic, around + "actuator_function");
    return reading;
  }

  bool take_data(std::string_view payload) {
    if (payload.size() < 2) return false;
    const auto found = subscriptions_.find(raw<std::uint16_t>(payload));
    if (found == subscriptions_.end()) return false;
    const Subscription& subscription = found->second;
    if (subscription.readings.empty()) return true;
    payload.remove_prefix(2);
    if (payload.size() < subscription.least || payload.size() > subscription.most) return false;
    const std::uint64_t stamp = raw<std::uint64_t>(payload.substr(subscription.timestamp.offset));
    for (const SeriesPlace& reading : subscription.readings) take_number(reading, payload, stamp);
    return true;
  }

  void take_number(const SeriesPlace& reading, std::string_view message, std::uint64_t stamp) {
    if (reading.valid && reading.valid->in(message) == 0) return;
    std::size_t series = reading.series;
    if (reading.motor) {
      // A controller of motors says which motor it drives; its place in the message is that of its address.
      const double motor = reading.motor->in(message)-kFirstMotor;
      const std::size_t from = series - series_.all()[series].source.index;
      if (motor >= 0 && motor < static_cast<double>(kEscs)) series = from + static_cast<std::size_t>(motor);
    }
    if (reading.time && reading.time->type->bytes == 8) {
      const auto own = raw<std::uint64_t>(message.substr(reading.time->offset));
      if (own != 0) stamp = own;
    }
    const double time_s = 1e-6 * static_cast<double>(static_cast<std::int64_t>(stamp - start_us_));
    series_.add(series, time_s, reading.value.in(message));
  }

  void note_dropout(std::uint16_t ms) {
    ++dropouts_;
    dropout_ms_ += ms;
    longest_dropout_ms_ = std::max<unsigned>(longest_dropout_ms_, ms);
  }

  void describe(FlightLog& log) const {
    if (dropouts_ > 0)
      log.findings.push_back(
          {Severity::warning,
           fmt::format("the logger dropped messages {} times, {:.3g} s together, {:.3g} s at most", dropouts_,
                       1e-3 * static_cast<double>(dropout_ms_), 1e-3 * longest_dropout_ms_),
           "log fewer topics, or use a faster card"});
    if (damaged_ > 0)
      log.findings.push_back(
          {Severity::warning,
           fmt::format("{} damaged parts, {}, are left out", damaged_, bytes_in_words(damaged_bytes_)),
           "copy the log from the card again"});
    if (cut_) log.findings.push_back({Severity::note, "the log ends in the middle of a message", ""});
  }

  std::string_view bytes_;
  const std::string& path_;
  UlogTypes types_;
  SeriesSet series_;
  bool rotors_told_;
  std::uint64_t start_us_ = 0;
  std::vector<std::size_t> ends_;
  std::map<std::uint16_t, Subscription> subscriptions_;
  std::set<std::size_t> read_series_;
  std::size_t dropouts_ = 0, damaged_ = 0, damaged_bytes_ = 0, dropout_ms_ = 0;
  unsigned longest_dropout_ms_ = 0;
  bool cut_ = false;
};

}  // namespace

void read_ulog(std::string_view bytes, const std::string& path, const FlightLayout& layout, FlightLog& log) {
  log.format = "PX4 ULog";
  UlogReader(bytes, path, layout).read(log);
}

}  // namespace kphi::fit
