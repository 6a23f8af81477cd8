#include "results/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/error.hpp"
#include "results/file_layer.hpp"

namespace kphi::results {
namespace {

constexpr std::string_view kCheckKey = ",\"check\":\"";
constexpr std::size_t kCheckDigits = 16;

/// `body` is the line's object without its closing brace and without the checksum.
std::string check_of(const std::string& previous, std::string_view body) {
  return sha256(previous + std::string(body)).substr(0, kCheckDigits);
}

struct Lines {
  std::vector<JournalEntry> entries;
  std::string check;
  std::size_t whole_bytes = 0;
  bool torn = false;
  std::optional<std::string> problem;
};

/// Fills `entry`; the problem if the line is not an entry.
std::optional<std::string> parse_line(std::string_view line, std::uint64_t n, std::string& check, JournalEntry& entry) {
  const std::size_t at = line.rfind(kCheckKey);
  if (at == std::string_view::npos || line.size() != at + kCheckKey.size() + kCheckDigits + 2) return "has no checksum";
  const std::string stored(line.substr(at + kCheckKey.size(), kCheckDigits));
  if (stored != check_of(check, line.substr(0, at)))
    return "does not match its checksum: this line or the one before was changed";
  try {
    const nlohmann::json object = nlohmann::json::parse(line);
    entry = {object.at("n"), object.at("t_ns"), object.at("utc"), object.at("event"), object.at("data")};
  } catch (const nlohmann::json::exception& error) {
    return error.what();
  }
  if (entry.n != n) return fmt::format("has number {} where {} was expected", entry.n, n);
  check = stored;
  return std::nullopt;
}

Lines parse(std::string_view text) {
  Lines lines;
  while (lines.whole_bytes < text.size()) {
    const std::size_t end = text.find('\n', lines.whole_bytes);
    if (end == std::string_view::npos) {
      lines.torn = true;
      break;
    }
    const std::string_view line = text.substr(lines.whole_bytes, end - lines.whole_bytes);
    if (end + 1 == text.size() && line.find('\0') != std::string_view::npos) {
      lines.torn = true;
      break;
    }
    JournalEntry entry;
    lines.problem = parse_line(line, lines.entries.size() + 1, lines.check, entry);
    if (lines.problem) break;
    lines.entries.push_back(std::move(entry));
    lines.whole_bytes = end + 1;
  }
  return lines;
}

JournalReading reading_of(Lines& lines, const std::filesystem::path& path) {
  JournalReading reading;
  if (lines.problem) {
    reading.problems.push_back(fmt::format("{}:{}: {}", path.string(), lines.entries.size() + 1, *lines.problem));
  }
  reading.torn_last_line = lines.torn;
  reading.entries = std::move(lines.entries);
  return reading;
}

}  // namespace

JournalReading read_journal(const std::filesystem::path& path) {
  Lines lines = parse(read_text(path));
  return reading_of(lines, path);
}

Journal::Journal(std::filesystem::path path, FileLayer& files) : path_(std::move(path)), files_(files) {
  const bool is_new = !std::filesystem::exists(path_);
  Lines lines = is_new ? Lines{} : parse(read_text(path_));
  found_ = reading_of(lines, path_);
  if (!found_.problems.empty()) throw RecordError(found_.problems.front() + "; start a new campaign folder");
  next_ = found_.entries.size() + 1;
  check_ = lines.check;
  whole_bytes_ = lines.whole_bytes;
  file_ = Descriptor(::open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
  if (file_.number() < 0) throw RecordError(failure_text(path_.string(), errno));
  try {
    if (::ftruncate(file_.number(), static_cast<off_t>(whole_bytes_)) != 0) {
      throw std::system_error(errno, std::generic_category());
    }
    if (is_new) files_.sync_folder(path_.parent_path());
  } catch (const std::system_error& error) {
    throw RecordError(failure_text(path_.string(), error.code().value()));
  }
}

void Journal::append(const std::string& event, const nlohmann::json& data, Nanoseconds time_ns,
                     const std::string& utc) {
  nlohmann::ordered_json object{{"n", next_}, {"t_ns", time_ns}, {"utc", utc}, {"event", event}};
  object["data"] = data.is_null() ? nlohmann::json::object() : data;
  std::string line = object.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  line.pop_back();
  const std::string check = check_of(check_, line);
  line += fmt::format("{}{}\"}}\n", kCheckKey, check);
  if (spoilt_) throw RecordError(path_.string() + ": an earlier line was not written completely; see the first error");
  try {
    files_.before_write(line.size());
    write_all(file_.number(), line);
    files_.sync_data(file_.number());
  } catch (const std::system_error& error) {
    spoilt_ = ::ftruncate(file_.number(), static_cast<off_t>(whole_bytes_)) != 0;
    throw RecordError(failure_text(path_.string(), error.code().value()));
  }
  ++next_;
  check_ = check;
  whole_bytes_ += line.size();
}

}  // namespace kphi::results
