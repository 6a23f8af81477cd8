#include "results/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <optional>
#include <string_view>
#include <utility>

#include "base/error.hpp"
#include "base/text.hpp"
#include "results/checksums.hpp"
#include "results/digest.hpp"

namespace kphi::results {
namespace {

constexpr std::string_view kCheckKey = ",\"check\":\"";
constexpr std::size_t kCheckDigits = 16;

/// `body` is the line's object without its closing brace and without the checksum.
std::string check_of(const std::string& previous, std::string_view body) {
  return sha256(previous + std::string(body)).substr(0, kCheckDigits);
}

/// Whether the known keys of an entry's data hold what their readers expect, and name files of the folder alone.
std::optional<std::string> problem_of(const nlohmann::json& data) {
  if (!data.is_object()) return "has data that are no object";
  const auto is_of_folder = [](const std::string& file) -> std::optional<std::string> {
    if (lies_inside(file)) return std::nullopt;
    return fmt::format("names a file outside the folder: {}", printable(file));
  };
  for (const char* key :
       {"file", "sha256", "contents_xxh128", "run", "reason", "cell_serial", "load_cell", "motor", "supply"})
    if (data.contains(key) && !data[key].is_string()) return fmt::format("{} must be a text", key);
  if (data.contains("file"))
    if (auto problem = is_of_folder(data["file"])) return problem;
  if (!data.contains("files")) return std::nullopt;
  if (!data["files"].is_object()) return "files must be an object";
  for (const auto& [file, digest] : data["files"].items()) {
    if (!digest.is_string()) return fmt::format("the SHA-256 of {} must be a text", printable(file));
    if (auto problem = is_of_folder(file)) return problem;
  }
  return std::nullopt;
}

/// Fills `entry`; the problem if the line is not an entry.
std::optional<std::string> parse_line(std::string_view line, std::uint64_t n, std::string& check, JournalEntry& entry) {
  const std::size_t at = line.rfind(kCheckKey);
  if (at == std::string_view::npos || line.size() != at + kCheckKey.size() + kCheckDigits + 2) return "has no checksum";
  const std::string stored(line.substr(at + kCheckKey.size(), kCheckDigits));
  if (stored != check_of(check, line.substr(0, at)))
    return "does not match its checksum: this line or the one before was changed";
  try {
    const nlohmann::json object = nlohmann::json::parse(line);
    for (const char* whole : {"n", "t_ns"})  // one with an exponent fits into no integer
      if (!object.at(whole).is_number_integer()) return fmt::format("has a {} that is not a whole number", whole);
    entry = {object.at("n"), object.at("t_ns"), object.at("utc"), object.at("event"), object.at("data")};
  } catch (const nlohmann::json::exception& error) {
    return error.what();
  }
  if (auto problem = problem_of(entry.data)) return problem;
  if (entry.n != n) return fmt::format("has number {} where {} was expected", entry.n, n);
  check = stored;
  return std::nullopt;
}

}  // namespace

JournalReading read_journal(const std::filesystem::path& path) { return parse_journal(read_text(path), path.string()); }

std::string chained_line(const std::string& check, std::string_view object) {
  return fmt::format("{}{}{}\"}}\n", object, kCheckKey, check_of(check, object));
}

JournalReading parse_journal(std::string_view text, const std::string& path) {
  JournalReading reading;
  while (reading.whole_bytes < text.size()) {
    const std::size_t begin = reading.whole_bytes, end = text.find('\n', begin);
    const std::string_view line = text.substr(begin, end - begin);
    reading.torn_last_line =
        end == std::string::npos || (end + 1 == text.size() && line.find('\0') != std::string_view::npos);
    if (reading.torn_last_line) break;
    JournalEntry entry;
    const std::uint64_t n = reading.entries.size() + 1;
    if (const auto problem = parse_line(line, n, reading.check, entry)) {
      reading.problems.push_back(fmt::format("{}:{}: {}", path, n, *problem));
      break;
    }
    reading.entries.push_back(std::move(entry));
    reading.whole_bytes = end + 1;
  }
  return reading;
}

Journal::Journal(std::filesystem::path path, FileLayer& files) : path_(std::move(path)), files_(files) {
  const bool is_new = !std::filesystem::exists(path_);
  if (!is_new) found_ = read_journal(path_);
  if (!found_.problems.empty()) throw RecordError(found_.problems.front() + "; start a new campaign folder");
  next_ = found_.entries.size() + 1;
  file_ = Descriptor(::open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
  if (file_.number() < 0 || ::ftruncate(file_.number(), static_cast<off_t>(found_.whole_bytes)) != 0)
    throw RecordError(failure_text(path_.string(), errno));
  if (is_new) on_disk(path_.string(), [&] { files_.sync_folder(path_.parent_path()); });
}

void Journal::append(const std::string& event, const nlohmann::json& data, Nanoseconds time_ns,
                     const std::string& utc) {
  nlohmann::ordered_json object{{"n", next_}, {"t_ns", time_ns}, {"utc", utc}, {"event", event}};
  object["data"] = data.is_null() ? nlohmann::json::object() : data;
  std::string line = object.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  line.pop_back();
  const std::string check = check_of(found_.check, line);
  line = chained_line(found_.check, line);
  if (spoilt_) throw RecordError(path_.string() + ": an earlier line was not written completely; see the first error");
  try {
    on_disk(path_.string(), [&] {
      files_.before_write(line.size());
      write_all(file_.number(), line);
      files_.sync_data(file_.number());
    });
  } catch (const RecordError&) {
    spoilt_ = ::ftruncate(file_.number(), static_cast<off_t>(found_.whole_bytes)) != 0;
    throw;
  }
  ++next_;
  found_.check = check;
  found_.whole_bytes += line.size();
}

}  // namespace kphi::results
