// The file that outlives a killed program: what it has changed in a box, and all slots as they were.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace kphi::netbox {

/// A setting that is to be set back.
struct ChangedSetting {
  std::string key;  ///< as the box calls it: setcfgsel, setuserfilter, comrdtrate, comrdtbsiz
  int before = 0;   ///< as the box showed it
  int applied = 0;  ///< as the box shows it since
  friend bool operator==(const ChangedSetting&, const ChangedSetting&) = default;
};

struct SettingsJournal {
  std::string box;  ///< mfgdigsn; empty when the box does not say
  std::vector<ChangedSetting> changed;
  std::vector<std::string> slots;  ///< netftapi2.xml of slot 0..15, verbatim
};

/// Whole on the disk when this returns. Throws DeviceError.
void write_journal(const std::filesystem::path& path, const SettingsJournal& journal);
/// Nothing: no such file. Throws DeviceError for a file that is no journal.
[[nodiscard]] std::optional<SettingsJournal> read_journal(const std::filesystem::path& path);
/// The removal is on the disk when this returns. Throws DeviceError.
void remove_journal(const std::filesystem::path& path);

}  // namespace kphi::netbox
