// Load cells and motors whose drivers are not kphi's own: offered by a word that a bench file may name.
// drivers/README.md says how to write one.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daq/bench/bench.hpp"
#include "profiles/bench_config.hpp"

namespace kphi::daq {

/// Connects to the device; `clock` outlives it. Throws DeviceError, ConfigurationError.
template <class Link>
using Connect = std::function<std::unique_ptr<Link>(const profiles::BenchConfig& bench, const Clock& clock)>;

/// Before any bench is connected; the runner's thread. A word that was offered before is replaced.
void offer_load_cell(const std::string& driver, Connect<LoadCellLink> connect);
void offer_motor(const std::string& driver, Connect<MotorLink> connect);

/// By the driver that the bench file names. Throws ConfigurationError, which lists the offered ones, if there is none;
/// and what the driver throws.
[[nodiscard]] std::unique_ptr<LoadCellLink> connect_load_cell(const profiles::BenchConfig& bench, const Clock& clock);
[[nodiscard]] std::unique_ptr<MotorLink> connect_motor(const profiles::BenchConfig& bench, const Clock& clock);

/// Moves the oldest of what waits to `out`, for a link's take(); how many.
template <class Record>
std::size_t move_oldest(std::vector<Record>& waiting, std::span<Record> out) {
  const std::size_t n = std::min(out.size(), waiting.size());
  std::copy_n(waiting.begin(), n, out.begin());
  waiting.erase(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(n));
  return n;
}

/// The settings of such a device; every name that the file gives must be asked for.
class DeviceSettings {
 public:
  explicit DeviceSettings(const profiles::OtherDevice& device) : device_(device) {}
  /// Throws ConfigurationError where it is missing and there is no `otherwise`, or outside [low, high].
  [[nodiscard]] double number(const std::string& name, double low, double high, std::optional<double> otherwise = {});
  /// Throws ConfigurationError for a name that nobody asked for.
  void finish() const;

 private:
  const profiles::OtherDevice& device_;
  std::string known_;
  int asked_ = 0;  ///< of those that the file gives
};

}  // namespace kphi::daq
