#include "drivers/netbox/configuration/settings_journal.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <pugixml.hpp>
#include <sstream>
#include <system_error>

#include "base/error.hpp"

namespace kphi::netbox {
namespace {

constexpr const char* kRoot = "kphi-netbox-settings";
// Verbatim: line ends and blanks stay.
constexpr unsigned kParse = pugi::parse_escapes | pugi::parse_ws_pcdata;

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& cause, const std::string& next_move) {
  throw DeviceError("Net Box", "keep the settings in " + path.string(), cause, next_move);
}

[[noreturn]] void refuse_by_errno(const std::filesystem::path& path) {
  refuse(path, std::strerror(errno), "check the folder and the space on the disk");
}

class OpenFile {
 public:
  OpenFile(const std::filesystem::path& path, int flags) : descriptor_(open(path.c_str(), flags | O_CLOEXEC, 0644)) {}
  ~OpenFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  [[nodiscard]] bool write_and_sync(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t written = write(descriptor_, text.data(), text.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return false;
      text.remove_prefix(static_cast<std::size_t>(written));
    }
    return fsync(descriptor_) == 0;
  }

 private:
  int descriptor_;
};

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

void sync_folder(const std::filesystem::path& path) {
  if (!OpenFile(folder_of(path), O_RDONLY | O_DIRECTORY).write_and_sync({})) refuse_by_errno(path);
}

std::string document_of(const SettingsJournal& journal) {
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
  for (const std::string& slot : journal.slots) root.append_child("slot").text() = slot.c_str();
  std::ostringstream out;
  document.save(out, "", pugi::format_raw);
  return out.str();
}

}  // namespace

void write_journal(const std::filesystem::path& path, const SettingsJournal& journal) {
  std::error_code error;
  std::filesystem::create_directories(folder_of(path), error);
  const std::filesystem::path part = path.string() + ".part";
  if (!OpenFile(part, O_WRONLY | O_CREAT | O_TRUNC).write_and_sync(document_of(journal))) refuse_by_errno(path);
  if (std::rename(part.c_str(), path.c_str()) != 0) refuse_by_errno(path);
  sync_folder(path);
}

std::optional<SettingsJournal> read_journal(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return std::nullopt;
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_file(path.c_str(), kParse);
  const pugi::xml_node root = document.child(kRoot);
  if (!result || root.attribute("version").as_int() != 1) {
    refuse(path, "this file is no journal of the box's settings",
           "compare the box's settings with what you expect, then remove the file");
  }
  SettingsJournal journal;
  journal.box = root.attribute("box").value();
  for (const pugi::xml_node& node : root.children("changed")) {
    journal.changed.push_back(
        {node.attribute("key").value(), node.attribute("before").as_int(), node.attribute("applied").as_int()});
  }
  for (const pugi::xml_node& node : root.children("slot")) journal.slots.emplace_back(node.text().get());
  return journal;
}

void remove_journal(const std::filesystem::path& path) {
  if (unlink(path.c_str()) != 0 && errno != ENOENT) refuse_by_errno(path);
  sync_folder(path);
}

}  // namespace kphi::netbox
