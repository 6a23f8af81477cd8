#include "daq/bench/offered_drivers.hpp"

#include <fmt/format.h>

#include <map>

#include "base/error.hpp"

namespace kphi::daq {
namespace {

template <class Link>
std::map<std::string, Connect<Link>>& offered() {
  static std::map<std::string, Connect<Link>> table;
  return table;
}

template <class Link>
std::unique_ptr<Link> connect(const char* key, const std::optional<profiles::OtherDevice>& device,
                              const profiles::BenchConfig& bench, const Clock& clock) {
  const auto& table = offered<Link>();
  const auto found = table.find(device->driver);
  if (found != table.end()) return found->second(bench, clock);
  std::string known;
  for (const auto& [word, make] : table) known += (known.empty() ? "" : ", ") + word;
  throw ConfigurationError(fmt::format("{}: {}.driver: {} is unknown; this kphi has {}", bench.path, key,
                                       device->driver, known.empty() ? "none" : known));
}

}  // namespace

void offer_load_cell(const std::string& driver, Connect<LoadCellLink> connect) {
  offered<LoadCellLink>()[driver] = std::move(connect);
}

void offer_motor(const std::string& driver, Connect<MotorLink> connect) {
  offered<MotorLink>()[driver] = std::move(connect);
}

std::unique_ptr<LoadCellLink> connect_load_cell(const profiles::BenchConfig& bench, const Clock& clock) {
  return connect<LoadCellLink>("load_cell", bench.load_cell, bench, clock);
}

std::unique_ptr<MotorLink> connect_motor(const profiles::BenchConfig& bench, const Clock& clock) {
  return connect<MotorLink>("motor", bench.motor, bench, clock);
}

double DeviceSettings::number(const std::string& name, double low, double high, std::optional<double> otherwise) {
  known_ += (known_.empty() ? "" : ", ") + name;
  const auto found = device_.settings.find(name);
  if (found == device_.settings.end() && otherwise) return *otherwise;
  if (found == device_.settings.end())
    throw ConfigurationError(
        fmt::format("{}: settings.{} is missing; write {:g} to {:g}", device_.driver, name, low, high));
  ++asked_;
  if (found->second >= low && found->second <= high) return found->second;
  throw ConfigurationError(
      fmt::format("{}: settings.{}: {:g} is not within {:g} to {:g}", device_.driver, name, found->second, low, high));
}

void DeviceSettings::finish() const {
  if (asked_ == static_cast<int>(device_.settings.size())) return;
  throw ConfigurationError(fmt::format("{}: settings has a name that this driver does not know; it knows {}",
                                       device_.driver, known_.empty() ? "none" : known_));
}

}  // namespace kphi::daq
