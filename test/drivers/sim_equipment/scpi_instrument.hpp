// A simulated instrument that speaks SCPI, whatever wire it hangs on: a supply with its limits, protections and load,
// or a meter. Written from SCPI-99 and the makers' guides, not from the driver's dialects.
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kphi::sim {

enum class ScpiKind : std::uint8_t { supply, meter };
enum class ScpiFamily : std::uint8_t { standard, rigol };

struct ScpiType {
  std::string identity = "KPHI,SIM3010,SN0001,1.00";
  ScpiKind kind = ScpiKind::supply;
  ScpiFamily family = ScpiFamily::standard;
  double voltage_max_v = 30, current_max_a = 10;
  bool measures_power = true;
  bool plain_errors = false;  ///< SYST:ERR? answers `0  No Error`, as several makes do
  bool tells_status = true;   ///< false: of a supply, neither protection nor questionable status can be asked
};

/// Everything inside, plain.
struct ScpiState {
  double voltage_v = 0, current_a = 0.1;            ///< settings
  double over_voltage_v = 33, over_current_a = 11;  ///< thresholds
  bool over_voltage_armed = false, over_current_armed = false;
  bool over_voltage_tripped = false, over_current_tripped = false;
  bool output = false;
  double load_ohm = 1e9;                          ///< at the supply's terminals
  double seen_voltage_v = 0, seen_current_a = 0;  ///< at a meter's
  std::deque<std::pair<int, std::string>> errors;
};

class ScpiInstrument {
 public:
  explicit ScpiInstrument(ScpiType type = {});

  /// One program message without its end; what it answers, the answers to several queries with ';' between. Empty:
  /// nothing was asked, or what was asked is unknown.
  [[nodiscard]] std::string apply(std::string_view message);
  void connect_load(double ohm);
  /// What a meter sees.
  void present(double volts, double amperes);
  [[nodiscard]] ScpiState state() const;
  /// What stands at a supply's terminals.
  [[nodiscard]] std::pair<double, double> terminals() const;
  /// Every program message so far, as it came.
  [[nodiscard]] std::vector<std::string> heard() const;
  /// As a wire does that lost data: IEEE 488.2, 6.5.7.3 (-400 and below).
  void note_error(int code, const char* words);

 private:
  std::string obey_unit(std::string_view unit);
  void settle();

  const ScpiType type_;
  mutable std::mutex mutex_;
  ScpiState state_;
  std::vector<std::string> heard_;
};

}  // namespace kphi::sim
