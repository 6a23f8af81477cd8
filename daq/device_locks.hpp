// Two programs never share a device: one lock per box, serial port and supply, for all programs and users of this host.
#pragma once

#include <string>
#include <vector>

#include "profiles/bench.hpp"
#include "results/campaign_folder.hpp"
#include "results/file_lock.hpp"

namespace kphi::daq {

/// What is locked, by what it is and not by how a bench file names it: "Net Box 192.168.1.1:49152", "port
/// /dev/ttyUSB0", "supply 10.0.0.5:502". Nothing for a bench inside the process.
[[nodiscard]] std::vector<std::string> lock_names(const profiles::Bench& place);

/// The devices of a bench, taken while this lives.
class DeviceLocks {
 public:
  /// Throws DeviceError that says who has one of them, and the next move.
  explicit DeviceLocks(const std::vector<std::string>& names);

 private:
  std::vector<results::FileLock> locks_;
};

/// Nobody else runs a campaign into this folder. Throws ConfigurationError that says who does.
[[nodiscard]] results::FileLock lock_folder(const results::CampaignFolder& folder);

}  // namespace kphi::daq
