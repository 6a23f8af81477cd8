// Settings of the box that a campaign wants otherwise: written before it, read back, and set back after it, even when
// the program is killed in between. Nothing else of the box can be written from here; its network settings never.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "drivers/netbox/configuration/address.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/configuration/finding.hpp"
#include "drivers/netbox/configuration/settings_journal.hpp"

namespace kphi::netbox {

/// Nothing = left as the box has it.
struct WantedSettings {
  std::optional<int> rate_hz = std::nullopt;               ///< 1..7000; the box runs 7000/floor(7000/rate)
  std::optional<int> records_per_datagram = std::nullopt;  ///< 1..40
  std::optional<int> filter = std::nullopt;                ///< code 0..12, see filter_cutoff_hz
  std::optional<int> configuration = std::nullopt;         ///< slot 0..15; the box's web pages count from one
  [[nodiscard]] bool empty() const noexcept { return !rate_hz && !records_per_datagram && !filter && !configuration; }
};

/// Blocks for 2 s at most per request to a box that does not answer; at most 16 + a few requests. One thread. The box
/// must not be streaming: some stop when the rate is written.
class SettingsKeeper {
 public:
  /// Recovers what an earlier program has left in `journal`; reads the configuration; when something is to change,
  /// keeps before() and the XML of all 16 slots in `journal` (synced to the disk), then writes, one URL per page, and
  /// reads back. Writes nothing, and no journal, when `wanted` is empty or the box is so already. Throws DeviceError,
  /// with what was changed set back: out of range, a slot that measures nothing, rate or
  /// filter of an Ethernet Axia, the box does not answer 302 or does
  /// not take a setting.
  SettingsKeeper(Address address, const WantedSettings& wanted, std::filesystem::path journal);
  /// As restore(). What fails stays in the journal.
  ~SettingsKeeper();
  SettingsKeeper(const SettingsKeeper&) = delete;
  SettingsKeeper& operator=(const SettingsKeeper&) = delete;

  [[nodiscard]] const Configuration& before() const noexcept { return before_; }
  /// As read back; equals before() when nothing was written.
  [[nodiscard]] const Configuration& after() const noexcept { return after_; }
  /// What is to be set back; empty when nothing was written.
  [[nodiscard]] const std::vector<ChangedSetting>& changed() const noexcept { return changed_; }
  /// Where the box took another value than was asked for, and what was recovered.
  [[nodiscard]] const std::vector<Finding>& notes() const noexcept { return notes_; }

  /// Sets back what was changed, reads it back and removes the journal; nothing the second time. What somebody else has
  /// changed since is left alone. Throws DeviceError; the journal stays then.
  void restore();

  /// Sets back what a killed program has left in `journal` and removes it; what was done, empty without a journal.
  /// Throws DeviceError: the box does not answer or is another one, or the journal is unreadable; it stays then.
  static std::vector<Finding> recover(const Address& address, const std::filesystem::path& journal);

 private:
  void apply(const WantedSettings& wanted);

  const Address address_;
  const std::filesystem::path journal_;
  Configuration before_, after_;
  std::vector<ChangedSetting> changed_;
  std::vector<Finding> notes_;
};

}  // namespace kphi::netbox
