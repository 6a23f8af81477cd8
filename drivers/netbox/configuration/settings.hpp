// Changes settings of the box for a campaign: writes them, reads them back, and restores them afterwards, even if the
// program is killed in between. Nothing else of the box can be written from here; its network settings never.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/finding.hpp"
#include "drivers/netbox/configuration/configuration.hpp"

namespace kphi::netbox {

/// A setting to restore.
struct ChangedSetting {
  std::string key;  ///< as the box calls it: setcfgsel, setuserfilter, comrdtrate, comrdtbsiz
  int before = 0;   ///< as the box showed it
  int applied = 0;  ///< as the box shows it after the change
  friend bool operator==(const ChangedSetting&, const ChangedSetting&) = default;
};

struct SettingsJournal {
  std::string box;  ///< mfgdigsn; empty if the box reports none
  std::vector<ChangedSetting> changed;
  std::string page;  ///< netftapi2.xml before the change, verbatim, for a person
};

/// On the disk when this returns. Throws DeviceError.
void write_journal(const std::filesystem::path& path, const SettingsJournal& journal);
/// nullopt: no such file. Throws DeviceError if the file is not a journal.
[[nodiscard]] std::optional<SettingsJournal> read_journal(const std::filesystem::path& path);
/// The removal is on the disk when this returns. Throws DeviceError.
void remove_journal(const std::filesystem::path& path);

/// nullopt: stays as the box has it.
struct WantedSettings {
  std::optional<int> rate_hz = std::nullopt;               ///< 1..7000; the box runs 7000/floor(7000/rate)
  std::optional<int> records_per_datagram = std::nullopt;  ///< 1..40
  std::optional<int> filter = std::nullopt;                ///< code 0..12, see filter_cutoff_hz
  std::optional<int> configuration = std::nullopt;         ///< slot 0..15; the box's web pages count from one
  friend bool operator==(const WantedSettings&, const WantedSettings&) = default;
};

/// Each request blocks for at most 2 s; there are two for each change, and two more. One thread. The box must not
/// stream: some stop when the rate is written.
class SettingsKeeper {
 public:
  /// Restores the settings that a killed program has left in `journal`; asks for nothing else if `wanted` is empty.
  /// Reads the configuration; if a setting differs, keeps their values in `journal` (synced to the disk), then writes,
  /// one URL per page, and reads back. Writes nothing, and no journal, if all is so already. Throws DeviceError, after
  /// restoring what was changed: out of range, an unusable slot, rate or filter of an Ethernet Axia, the box does not
  /// answer 302 or refuses a setting.
  SettingsKeeper(Address address, const WantedSettings& wanted, std::filesystem::path journal);
  /// As restore(); settings that cannot be restored stay in the journal.
  ~SettingsKeeper();
  SettingsKeeper(const SettingsKeeper&) = delete;
  SettingsKeeper& operator=(const SettingsKeeper&) = delete;

  /// Settings for which the box chose another value, and settings restored from the journal.
  [[nodiscard]] const std::vector<Finding>& notes() const noexcept { return notes_; }

  /// Restores the settings, reads them back and removes the journal; does nothing the second time. Settings changed by
  /// somebody else since stay. Throws DeviceError and keeps the journal.
  void restore();

  /// Restores the settings that a killed program has left in `journal` and removes it; returns what was restored, empty
  /// without a journal. Throws DeviceError and keeps the journal if the box does not answer or is a different one, or
  /// if the journal is unreadable.
  static std::vector<Finding> recover(const Address& address, const std::filesystem::path& journal);

 private:
  void apply(const WantedSettings& wanted);
  void try_to_restore();

  const Address address_;
  const std::filesystem::path journal_;
  std::vector<Finding> notes_;
};

}  // namespace kphi::netbox
