#include "drivers/netbox/configuration/settings.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <pugixml.hpp>
#include <system_error>
#include <thread>
#include <utility>

#include "base/descriptor.hpp"
#include "base/error.hpp"
#include "base/number.hpp"
#include "drivers/netbox/configuration/http.hpp"

namespace kphi::netbox {
namespace {

constexpr std::chrono::seconds kTimeout{2};
constexpr int kSlots = 16;
// Some boxes serve only the first three writes of a second: ignored ones are repeated, later each time.
constexpr int kAttempts = 4;
constexpr std::chrono::milliseconds kPause{400};

/// The settings that can be written, and on which page. Network settings are not here: a wrong address cannot be fixed
/// over the network.
struct Setting {
  const char* page;
  const char* key;
  const char* name;
  std::optional<int> WantedSettings::*wanted;
  int low, high;
};
constexpr Setting kSettings[] = {
    {"setting.cgi", "setcfgsel", "configuration", &WantedSettings::configuration, 0, kSlots - 1},
    {"setting.cgi", "setuserfilter", "filter", &WantedSettings::filter, 0, 12},
    {"comm.cgi", "comrdtrate", "rate_hz", &WantedSettings::rate_hz, 1, 7000},
    {"comm.cgi", "comrdtbsiz", "records_per_datagram", &WantedSettings::records_per_datagram, 1, 40},
};

std::string device(const Address& address) { return "Net Box " + address.host; }

/// The elements of netftapi2.xml; works for an unusable slot, too.
class Shown {
 public:
  explicit Shown(const Address& address)
      : device_(device(address)), xml_(http_get(address.where(), address.http_port, "/netftapi2.xml", kTimeout)) {
    document_.load_buffer(xml_.data(), xml_.size());
  }
  [[nodiscard]] std::string text(const char* key) const { return document_.child("netft").child_value(key); }
  [[nodiscard]] int number(const std::string& key) const {
    const std::string value = text(key.c_str());
    if (const auto number = parse_integer<int>(value)) return *number;
    throw DeviceError(device_, "read its settings", fmt::format("<{}> holds \"{}\"", key, value),
                      "open netftapi2.xml in a browser and compare");
  }
  [[nodiscard]] const std::string& xml() const noexcept { return xml_; }

 private:
  std::string device_, xml_;
  pugi::xml_document document_;
};

/// A change: shown before, requested.
struct Assignment {
  const Setting* setting;
  int before, asked;
};

void write_once(const Address& address, const std::vector<Assignment>& assignments) {
  for (const char* page : {"setting.cgi", "comm.cgi"}) {
    std::string query;
    for (const Assignment& a : assignments) {
      if (std::string_view(a.setting->page) == page)
        query += fmt::format("{}{}={}", query.empty() ? '?' : '&', a.setting->key, a.asked);
    }
    if (!query.empty())
      (void)http_get(address.where(), address.http_port, fmt::format("/{}{}", page, query), kTimeout, kFound);
  }
}

/// Repeats the writes that the box has ignored.
Shown write_and_read_back(const Address& address, std::vector<Assignment> assignments) {
  for (int attempt = 0;; ++attempt) {
    write_once(address, assignments);
    Shown shown(address);
    std::erase_if(assignments, [&](const Assignment& a) { return shown.number(a.setting->key) != a.before; });
    if (assignments.empty() || attempt + 1 == kAttempts) return shown;
    std::this_thread::sleep_for((attempt + 1) * kPause);
  }
}

/// The value that the box will show.
int expected(const Setting& setting, int asked, const Configuration& box) {
  if (setting.wanted != &WantedSettings::rate_hz) return asked;
  const int device_rate = static_cast<int>(box.device_rate_hz);
  return device_rate / std::max(1, device_rate / asked);
}

void check_ranges(const Address& address, const WantedSettings& wanted) {
  for (const Setting& s : kSettings) {
    const auto& value = wanted.*s.wanted;
    if (!value || (*value >= s.low && *value <= s.high)) continue;
    throw DeviceError(device(address), "write its settings",
                      fmt::format("{} {} is not from {} to {}", s.name, *value, s.low, s.high), "nothing was written");
  }
}

/// An Axia has the rate of its converter, and its filters depend on it: neither is known well enough to write it.
void check_product(const Address& address, const Configuration& box, const WantedSettings& wanted) {
  if (box.kind == Product::net_box || (!wanted.rate_hz && !wanted.filter)) return;
  throw DeviceError(device(address), "write its settings",
                    "rate_hz and filter of an Ethernet Axia cannot be written from here",
                    "set them on the sensor's web pages and leave them out of the bench file; nothing was written");
}

std::vector<Assignment> differences(const Shown& shown, const Configuration& box, const WantedSettings& wanted) {
  std::vector<Assignment> found;
  for (const Setting& s : kSettings) {
    const auto& asked = wanted.*s.wanted;
    if (!asked) continue;
    const int before = shown.number(s.key);
    if (before != expected(s, *asked, box)) found.push_back({&s, before, *asked});
  }
  return found;
}

/// Throws DeviceError for one that measures nothing.
void check_slot(const Address& address, int slot) {
  const std::string page =
      http_get(address.where(), address.http_port, fmt::format("/netftapi2.xml?index={}", slot), kTimeout);
  (void)parse_configuration(page, fmt::format("{}, slot {}", device(address), slot));
}

/// Findings: what was set back, and what somebody else has changed since.
std::vector<Finding> set_back(const Address& address, const std::vector<ChangedSetting>& changed) {
  const Shown present(address);
  std::vector<Assignment> assignments;
  std::vector<Finding> findings;
  for (const ChangedSetting& c : changed) {
    const Setting* setting = std::ranges::find(kSettings, c.key, &Setting::key);
    if (setting == std::end(kSettings) || present.number(c.key) == c.before) continue;
    if (present.number(c.key) == c.applied) {
      assignments.push_back({setting, c.applied, c.before});
    } else {
      findings.push_back({Severity::warning,
                          fmt::format("{} was set from {} to {}, then changed to {} by somebody else: not restored",
                                      setting->name, c.before, c.applied, present.number(c.key)),
                          "check the box's settings"});
    }
  }
  if (assignments.empty()) return findings;
  const Shown after = write_and_read_back(address, assignments);
  for (const Assignment& a : assignments) {
    if (after.number(a.setting->key) != a.asked) {
      throw DeviceError(device(address), "restore its settings",
                        fmt::format("{} is {}, expected {}", a.setting->name, after.number(a.setting->key), a.asked),
                        fmt::format("set {} to {} on the box's web pages", a.setting->key, a.asked));
    }
    findings.push_back(
        {Severity::note, fmt::format("{} was restored from {} to {}", a.setting->name, a.before, a.asked), ""});
  }
  return findings;
}

constexpr const char* kRoot = "kphi-netbox-settings";
// Verbatim: line ends and blanks stay.
constexpr unsigned kParse = pugi::parse_escapes | pugi::parse_ws_pcdata;

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& cause, const std::string& next_move) {
  throw DeviceError("Net Box", "keep the settings in " + path.string(), cause, next_move);
}

[[noreturn]] void refuse_by_errno(const std::filesystem::path& path) {
  refuse(path, std::strerror(errno), "check the folder and the space on the disk");
}

/// Forces a file or folder to the disk. Some file systems know no sync of a folder.
void sync(const std::filesystem::path& path) {
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.number() >= 0 && fsync(file.number()) == 0) return;
  const bool is_unknown = errno == EINVAL || errno == ENOSYS || errno == EOPNOTSUPP || errno == EPERM;
  if (file.number() < 0 || !is_unknown || !std::filesystem::is_directory(path)) refuse_by_errno(path);
}

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

}  // namespace

void write_journal(const std::filesystem::path& path, const SettingsJournal& journal) {
  pugi::xml_document document;
  pugi::xml_node root = document.append_child(kRoot);
  root.append_attribute("version") = 1;
  root.append_attribute("box") = journal.box.c_str();
  for (const ChangedSetting& changed : journal.changed) {
    pugi::xml_node node = root.append_child("changed");
    node.append_attribute("key") = changed.key.c_str();
    node.append_attribute("before") = changed.before;
    node.append_attribute("applied") = changed.applied;
  }
  root.append_child("page").text() = journal.page.c_str();
  std::error_code error;
  std::filesystem::create_directories(folder_of(path), error);
  const std::filesystem::path part = path.string() + ".part";
  if (!document.save_file(part.c_str(), "", pugi::format_raw)) refuse_by_errno(path);
  sync(part);
  if (std::rename(part.c_str(), path.c_str()) != 0) refuse_by_errno(path);
  sync(folder_of(path));
}

std::optional<SettingsJournal> read_journal(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return std::nullopt;
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_file(path.c_str(), kParse);
  const pugi::xml_node root = document.child(kRoot);
  if (!result || root.attribute("version").as_int() != 1) {
    refuse(path, "the file is not a journal of the box's settings",
           "compare the box's settings with what you expect, then remove the file");
  }
  SettingsJournal journal;
  journal.box = root.attribute("box").value();
  for (const pugi::xml_node& node : root.children("changed")) {
    journal.changed.push_back(
        {node.attribute("key").value(), node.attribute("before").as_int(), node.attribute("applied").as_int()});
  }
  journal.page = root.child("page").text().get();
  return journal;
}

void remove_journal(const std::filesystem::path& path) {
  if (unlink(path.c_str()) != 0 && errno != ENOENT) refuse_by_errno(path);
  sync(folder_of(path));
}

SettingsKeeper::SettingsKeeper(Address address, const WantedSettings& wanted, std::filesystem::path journal)
    : address_(std::move(address)), journal_(std::move(journal)) {
  check_ranges(address_, wanted);
  notes_ = recover(address_, journal_);
  try {
    apply(wanted);
  } catch (...) {
    try_to_restore();
    throw;  // the first failure is the one to tell
  }
}

SettingsKeeper::~SettingsKeeper() { try_to_restore(); }

void SettingsKeeper::try_to_restore() {
  try {
    restore();
  } catch (const std::exception&) {
    // The journal stays: the next start sets back.
  }
}

void SettingsKeeper::apply(const WantedSettings& wanted) {
  if (wanted == WantedSettings{}) return;
  const Shown shown(address_);
  const Configuration box = parse_configuration(shown.xml(), device(address_));
  check_product(address_, box, wanted);
  const std::vector<Assignment> assignments = differences(shown, box, wanted);
  if (assignments.empty()) return;
  if (wanted.configuration && *wanted.configuration != box.slot) check_slot(address_, *wanted.configuration);
  SettingsJournal journal{shown.text("mfgdigsn"), {}, shown.xml()};
  for (const Assignment& a : assignments)
    journal.changed.push_back({a.setting->key, a.before, expected(*a.setting, a.asked, box)});
  const std::vector<ChangedSetting> planned = journal.changed;
  write_journal(journal_, journal);
  const Shown after = write_and_read_back(address_, assignments);
  for (ChangedSetting& changed : journal.changed) changed.applied = after.number(changed.key);
  if (journal.changed != planned) write_journal(journal_, journal);
  for (std::size_t i = 0; i < assignments.size(); ++i) {
    const Assignment& a = assignments[i];
    const int applied = journal.changed[i].applied;
    if (applied == a.before) {
      throw DeviceError(device(address_), "write its settings",
                        fmt::format("the box keeps {} at {} and does not take {}", a.setting->name, a.before, a.asked),
                        "close the box's web pages and other programs that write to it");
    }
    if (applied == a.asked) continue;
    const bool quantised = applied == planned[i].applied;
    notes_.push_back({quantised ? Severity::note : Severity::warning,
                      fmt::format("{} {} requested, the box runs {}", a.setting->name, a.asked, applied),
                      quantised ? "" : "kphi measures with the box's value"});
  }
}

void SettingsKeeper::restore() {
  for (const Finding& finding : recover(address_, journal_)) {
    if (finding.severity != Severity::note) notes_.push_back(finding);
  }
}

std::vector<Finding> SettingsKeeper::recover(const Address& address, const std::filesystem::path& journal) {
  const std::optional<SettingsJournal> left = read_journal(journal);
  if (!left) return {};
  const std::string box = Shown(address).text("mfgdigsn");
  if (box != left->box) {
    throw DeviceError(device(address), "restore its settings",
                      fmt::format("{} belongs to box \"{}\", this one is \"{}\"", journal.string(), left->box, box),
                      "connect that box or remove the file");
  }
  std::vector<Finding> findings = set_back(address, left->changed);
  remove_journal(journal);
  return findings;
}

}  // namespace kphi::netbox
