// What a device says when `kphi devices` asks it: identity, readings, findings. Switches and sets nothing.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "daq/bench/bench.hpp"
#include "profiles/bench_config.hpp"

namespace kphi::daq {

struct DeviceAnswer {
  std::string device;  ///< as a bench file names it: "ambient usb:04d8:00dd:0001", "SCPI scpi-usb:1ab1:0e11"
  bool answers = false;
  std::string in_short{};              ///< what it is and shows
  std::vector<std::string> lines{};    ///< all it says
  std::vector<std::string> results{};  ///< of what was asked for besides
  nlohmann::ordered_json details{};
  std::vector<Finding> findings{};
  bool wanted = true;  ///< named in the bench file
  std::string says{};  ///< instead of "answers"

  /// Adds to the details, too.
  void add(const std::vector<Finding>& found);
  /// Of its worst finding; nullopt: none. One that is wanted and does not answer has a fault.
  [[nodiscard]] std::optional<Severity> worst() const;
};

/// Throws ConfigurationError for an invalid URI.
[[nodiscard]] DeviceAnswer ask_supply(const profiles::SupplyConfig& config, const Clock& clock);

/// The sensor of a bench file, "usb:04d8:00dd…".
[[nodiscard]] DeviceAnswer ask_sensor(const std::string& address);

/// All that are plugged in, except those of `known` device names; none of them is wanted. Never throws; empty without
/// USB.
[[nodiscard]] std::vector<DeviceAnswer> ask_usb(const std::vector<DeviceAnswer>& known);

}  // namespace kphi::daq
