// What a reader of one format decodes, before the channels are chosen from it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "fit/flights/flight_log.hpp"

namespace kphi::fit {

/// One source and its values in the channel's unit.
struct FlightSeries {
  FlightSource source;
  bool is_told = false;  ///< by a layout
  FlightChannel channel{};
  std::size_t not_finite = 0;  ///< values left out; of a command NaN is "stopped" and counts as 0
  std::size_t reversed = 0;    ///< commands below 0, counted as 0
  std::size_t backward = 0;    ///< values left out because their time was before the one before
};

/// All series of one log. Bounded: add() throws ConfigurationError beyond kMostFlightValues.
class SeriesSet {
 public:
  /// `of_format`: what the format says by itself, the preferred source of a channel first.
  SeriesSet(std::string path, const std::vector<FlightSource>& of_format, const FlightLayout& told);

  [[nodiscard]] const std::vector<FlightSeries>& all() const { return series_; }
  /// `value` in the unit of the source. A value at the time of the one before repeats it and is left out.
  void add(std::size_t series, double time_s, double value);
  /// Each channel by the first source that has values, that of a sensor by a later one of three times as many; and what
  /// the values say of themselves.
  void move_to(FlightLog& log);

 private:
  std::string path_;
  std::vector<FlightSeries> series_;
  std::size_t values_ = 0;
};

/// Three axes; `sign_yz` is -1 for a log whose y is right and z down.
[[nodiscard]] std::vector<FlightSource> axes(FlightQuantity quantity, const std::vector<std::string>& series,
                                             double factor, double sign_yz = 1);

/// Readers of one format each. `bytes`: the whole file. Throw ConfigurationError (one line).
void read_ulog(std::string_view bytes, const std::string& path, const FlightLayout& layout, FlightLog& log);
void read_card_log(std::string_view bytes, const std::string& path, const FlightLayout& layout, FlightLog& log);
void read_flight_table(std::string_view bytes, const std::string& path, const FlightLayout& layout, FlightLog& log);

inline constexpr std::string_view kUlogMagic = "ULog\x01\x12\x35";
inline constexpr char kCardLogMagic = '\xBC';

/// Gaps, saturation, values that never change, axes that look wrong.
[[nodiscard]] std::vector<Finding> audit_channels(const FlightLog& log);

}  // namespace kphi::fit
