// Two programs never share a device: one lock per box, serial port and supply, for all programs and users of this
// computer.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "profiles/bench_config.hpp"
#include "results/campaign_folder.hpp"
#include "results/file_lock.hpp"

namespace kphi::daq {

/// Names of the locks, by device, not by its name in a bench file: "Net Box 192.168.1.1:49152", "port
/// /dev/ttyUSB0", "supply 10.0.0.5:502". Empty for a bench inside the process.
[[nodiscard]] std::vector<std::string> lock_names(const profiles::BenchConfig& config);

/// Of such a lock.
[[nodiscard]] std::filesystem::path lock_file(const std::string& name);

/// Locks a bench's devices, while the result lives. Waits for the sentinel of a program that was killed. Throws
/// DeviceError with the program that uses one of them, and the next move.
[[nodiscard]] std::vector<results::FileLock> lock_devices(const std::vector<std::string>& names);

/// Locks a campaign's folder. Throws ConfigurationError with the program that uses it.
[[nodiscard]] results::FileLock lock_folder(const results::CampaignFolder& folder);

}  // namespace kphi::daq
