#include "daq/bench/box.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "daq/bench/device_records.hpp"

namespace kphi::daq {
namespace {

const char* unit_of(std::size_t axis) { return axis < 3 ? "N" : "N m"; }

}  // namespace

CalibrationPage read_calibration_page(const PageReader& page, int calibration) {
  CalibrationPage read;
  const std::string target = fmt::format("netftcalapi.xml?index={}", calibration);
  nlohmann::json pages{{target, nullptr}};
  try {
    pages[target] = page("/" + target);
  } catch (const DeviceError& error) {
    read.findings.push_back({Severity::warning,
                             fmt::format("could not read the page of the calibration: {}", error.what()),
                             "the runs will lack it; check the box: `kphi devices`"});
  }
  read.json = pages.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return read;
}

netbox::Changes changes_since(const netbox::Configuration& before, const netbox::Configuration& after, bool biased) {
  const netbox::Changes changes = netbox::compare(before, after);
  return biased ? changes & ~static_cast<netbox::Changes>(netbox::Change::gage_bias) : changes;
}

std::optional<StreamEvent> configuration_event(const netbox::Configuration& before, bool biased,
                                               const std::function<std::string()>& page,
                                               const std::function<Instant()>& now, int attempts) {
  StreamEvent failure;
  for (int attempt = 0; attempt < attempts; ++attempt) {
    EventKind kind = EventKind::unreachable;
    try {
      const std::string xml = page();
      kind = EventKind::unusable;
      const netbox::Changes changes = changes_since(before, netbox::parse_configuration(xml), biased);
      if (changes == 0) return std::nullopt;
      return event_at(now(), EventKind::configuration_changed,
                      "configuration changed since the run began: " + netbox::to_words(changes) +
                          "; all steps of this run are flagged");
    } catch (const DeviceError& error) {
      failure = event_at(now(), kind, std::string("configuration not verified after the run: ") + error.what());
    }
  }
  return failure;
}

std::optional<std::string> noise(const netbox::ZeroMeasurement& zero, std::size_t axis, double limit) {
  const double deviation = zero.standard_deviation[axis];
  if (deviation <= limit) return std::nullopt;  // written so that NaN is refused
  return fmt::format("{} is noisy: standard deviation {:.3g} {unit}, limit {:g} {unit}", kAxisNames[axis], deviation,
                     limit, fmt::arg("unit", unit_of(axis)));
}

std::optional<std::string> unrest(const netbox::ZeroMeasurement& before) {
  if (before.records < 2) return "no valid sample arrived";
  for (std::size_t axis = 0; axis < kAxisNames.size(); ++axis)
    if (auto why = noise(before, axis, axis < 3 ? kNoisyForce : kNoisyTorque)) return why;
  return std::nullopt;
}

std::optional<std::string> beyond_zero(const netbox::ZeroMeasurement& after, const netbox::BiasTolerance& tolerance) {
  if (after.records < 2) return "no valid sample arrived afterwards";
  for (std::size_t axis = 0; axis < kAxisNames.size(); ++axis) {
    const double allowed = axis < 3 ? tolerance.force_n : tolerance.torque_nm;
    if (std::abs(after.mean[axis]) < allowed) continue;
    return fmt::format("{} is {:.4g} {unit} afterwards, limit {:g} {unit}", kAxisNames[axis], after.mean[axis], allowed,
                       fmt::arg("unit", unit_of(axis)));
  }
  return std::nullopt;
}

results::BoxBias to_bias(const netbox::ZeroMeasurement& before, const netbox::ZeroMeasurement& after) {
  return {std::min(before.records, after.records), before.mean, before.standard_deviation, after.mean,
          after.standard_deviation};
}

}  // namespace kphi::daq
