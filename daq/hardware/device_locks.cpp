#include "daq/hardware/device_locks.hpp"

#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <cctype>
#include <chrono>
#include <fstream>
#include <system_error>
#include <thread>

#include "base/error.hpp"
#include "drivers/serial/port.hpp"

namespace kphi::daq {
namespace {

constexpr std::chrono::seconds kSentinelSpeaks{5};
constexpr std::chrono::milliseconds kAskAgain{20};

/// The same for all users, root included: programs of other users must see the locks.
std::filesystem::path lock_folder_of_host() {
  const std::filesystem::path usual = "/run/lock";
  std::error_code none;
  const auto found = std::filesystem::status(usual, none);
  const bool for_all = std::filesystem::is_directory(found) &&
                       (found.permissions() & std::filesystem::perms::others_write) != std::filesystem::perms::none;
  return for_all ? usual : std::filesystem::path("/tmp");
}

/// Its address, or the name itself if it cannot be resolved.
std::string address_of(const std::string& host) {
  boost::asio::io_context io;
  boost::system::error_code error;
  const auto found = boost::asio::ip::udp::resolver(io).resolve(boost::asio::ip::udp::v4(), host, "", error);
  return error || found.empty() ? host : found.begin()->endpoint().address().to_string();
}

/// With all links resolved; an adapter that is not plugged in keeps its name.
std::string real_port(const std::string& specification) {
  std::string path = specification;
  try {
    path = serial::path_of(specification);
  } catch (const DeviceError&) {
  }
  std::error_code none;
  const auto real = std::filesystem::canonical(path, none);
  return none ? path : real.string();
}

/// "modbus-rtu:/dev/ttyUSB1?model=…" is a port, "modbus-tcp:host:502" and "scpi-tcp:host:5025" are addresses.
std::string supply_name(const std::string& uri) {
  const std::string plain = uri.substr(0, uri.find('?'));
  const std::size_t colon = plain.find(':');
  if (colon == std::string::npos) return "supply " + plain;
  const std::string scheme = plain.substr(0, colon);
  const std::string rest = plain.substr(colon + 1);
  if (scheme == "modbus-rtu") return "port " + real_port(rest);
  const std::size_t port = rest.rfind(':');
  if (!scheme.ends_with("-tcp") || port == std::string::npos) return "supply " + rest;
  return "supply " + address_of(rest.substr(0, port)) + rest.substr(port);
}

/// The lock of a program that is dead is held by its sentinel, for as long as that speaks to the device. One whose
/// parent has not noticed is dead as well: it has no command line any more.
bool is_dead(const results::LockHolder& holder) {
  if (holder.pid == 0) return false;
  std::ifstream command(fmt::format("/proc/{}/cmdline", holder.pid));
  return command.peek() == std::ifstream::traits_type::eof();
}

results::FileLock take(const std::string& device) {
  try {
    results::LockHolder holder;
    const auto give_up = std::chrono::steady_clock::now() + kSentinelSpeaks;
    do {
      if (auto lock = results::FileLock::take(lock_file(device), holder)) return std::move(*lock);
      std::this_thread::sleep_for(kAskAgain);
    } while (is_dead(holder) && std::chrono::steady_clock::now() < give_up);
    throw InUse(fmt::format("{}: in use by {}; {}", device, holder.words(),
                            holder.pid == 0 ? "wait for that program or stop it"
                                            : fmt::format("wait for it, or stop it with: kill -INT {}", holder.pid)));
  } catch (const RecordError& error) {
    throw DeviceError(device, "lock", error.what(), "remove that file, or ask its owner to");
  }
}

}  // namespace

std::filesystem::path lock_file(const std::string& name) {
  std::string safe = name;
  for (char& c : safe) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-') c = '_';
  }
  return lock_folder_of_host() / ("kphi_" + safe + ".lock");
}

std::vector<std::string> lock_names(const profiles::BenchConfig& config) {
  if (config.simulation && config.simulation->in_process) return {};
  std::vector<std::string> names{
      config.load_cell ? "port " + real_port(config.load_cell->device)
                       : fmt::format("Net Box {}:{}", address_of(config.netbox.host), config.netbox.rdt_port),
      "port " + real_port(config.iq.device)};
  if (config.supply) names.push_back(supply_name(config.supply->uri));
  return names;
}

std::vector<results::FileLock> lock_devices(const std::vector<std::string>& names) {
  std::vector<results::FileLock> locks;
  for (const std::string& name : names) locks.push_back(take(name));
  return locks;
}

results::FileLock lock_folder(const results::CampaignFolder& folder) {
  results::LockHolder holder;
  auto lock = results::FileLock::take(folder.lock(), holder);
  if (lock) return std::move(*lock);
  throw InUse(fmt::format("{}: in use by {}; wait for it, or stop it{}", folder.path().string(), holder.words(),
                          holder.pid == 0 ? "" : fmt::format(" with: kill -INT {}", holder.pid)));
}

}  // namespace kphi::daq
