#include "profiles/campaign_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "profiles/strict_yaml.hpp"

namespace kphi::profiles {
namespace {

class Editor {
 public:
  Editor(std::string text, std::string path) : text_(std::move(text)), path_(std::move(path)) {}

  /// A value of a mapping at the top or one level below; the mapping is made if it is not there.
  void set(const std::string& parent, const std::string& key, const std::string& value) {
    const SourceDocument file = parse_strict_yaml(text_, path_);
    const std::string pointer = parent + "/" + key;
    const nlohmann::json::json_pointer place(pointer);
    if (file.value.contains(place)) return replace(file, pointer, value);
    if (parent.empty()) return insert_line(file, "/profile", key + ": " + value);
    if (!file.value.contains(nlohmann::json::json_pointer(parent)))
      return insert_line(file, "/profile", fmt::format("{}: {{{}: {}}}", parent.substr(1), key, value));
    const std::size_t begin = offset_of(file.value_mark(parent));
    if (text_.at(begin) == '{') {
      text_.insert(begin + 1, key + ": " + value + ", ");
      return;
    }
    const auto& mapping = file.value[nlohmann::json::json_pointer(parent)];
    insert_line(file, parent + "/" + mapping.begin().key(), key + ": " + value);
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  /// Columns count characters.
  [[nodiscard]] std::size_t offset_of(Mark mark) const {
    std::size_t at = 0;
    for (int line = 1; line < mark.line; ++line) at = text_.find('\n', at) + 1;
    for (int column = 1; column < mark.column; ++column)
      for (++at; at < text_.size() && is_continuation(text_[at]);) ++at;
    return at;
  }
  [[nodiscard]] std::size_t end_of_scalar(std::size_t begin) const {
    if (text_[begin] == '"' || text_[begin] == '\'') return text_.find(text_[begin], begin + 1) + 1;
    std::size_t end = begin;
    while (end < text_.size() && text_[end] != '\n' && text_[end] != ',' && text_[end] != '}' && text_[end] != ']' &&
           text_.compare(end, 2, " #") != 0)
      ++end;
    while (end > begin && (text_[end - 1] == ' ' || text_[end - 1] == '\r')) --end;
    return end;
  }
  void replace(const SourceDocument& file, const std::string& pointer, const std::string& value) {
    const std::size_t begin = offset_of(file.value_mark(pointer));
    const auto& now = file.value[nlohmann::json::json_pointer(pointer)];
    std::size_t end = 0;
    if (text_.at(begin) == '[') {
      end = text_.find(']', begin) + 1;
    } else if (now.is_array()) {
      const std::size_t last = offset_of(file.value_mark(fmt::format("{}/{}", pointer, now.size() - 1)));
      end = end_of_scalar(last);
    } else {
      end = end_of_scalar(begin);
    }
    text_.replace(begin, end - begin, value);
  }
  /// Before the line of a key, as far indented as the key.
  void insert_line(const SourceDocument& file, const std::string& before, const std::string& line) {
    const Mark mark = file.key_mark(before);
    const std::size_t at = offset_of({mark.line, 1});
    text_.insert(at, std::string(static_cast<std::size_t>(mark.column - 1), ' ') + line + "\n");
  }
  std::string text_, path_;
};

/// The seconds alone, or least and most.
std::string dwell(const StepProfile& profile) {
  const double most_s = profile.dwell.value();
  return profile.until ? fmt::format("[{:g}, {:g}]", profile.until->dwell_least.value(), most_s)
                       : fmt::format("{:g}", most_s);
}

std::string number(double value) { return fmt::format("{:g}", value); }

}  // namespace

std::string changed_text(const Campaign& campaign, const Campaign& wanted) {
  Editor editor(campaign.text, campaign.path);
  if (wanted.occlusions_deg != campaign.occlusions_deg)
    editor.set("", "occlusions_deg", fmt::format("[{:g}]", fmt::join(wanted.occlusions_deg, ", ")));
  if (wanted.repetitions != campaign.repetitions || wanted.repetitions_most != campaign.repetitions_most)
    editor.set("", "repetitions",
               wanted.repetitions_most ? fmt::format("[{}, {}]", wanted.repetitions, *wanted.repetitions_most)
                                       : std::to_string(wanted.repetitions));
  if (wanted.order.remount_each_repetition != campaign.order.remount_each_repetition)
    editor.set("/order", "remount_each_repetition", wanted.order.remount_each_repetition ? "true" : "false");
  if (wanted.profile.steps != campaign.profile.steps)
    editor.set("/profile", "steps", std::to_string(wanted.profile.steps));
  if (wanted.profile.until != campaign.profile.until || wanted.profile.dwell != campaign.profile.dwell)
    editor.set("/profile", "dwell_s", dwell(wanted.profile));
  if (wanted.profile.until && wanted.profile.until != campaign.profile.until)
    editor.set("/profile", "until", fmt::format("{{k_percent: {:g}}}", 100 * wanted.profile.until->k_share));
  if (wanted.zero.value() != campaign.zero.value()) editor.set("", "zero_s", number(wanted.zero.value()));
  if (wanted.name != campaign.name) editor.set("", "name", wanted.name);
  const Campaign read = parse_campaign(editor.text(), campaign.path);
  if (read.occlusions_deg != wanted.occlusions_deg || read.repetitions != wanted.repetitions ||
      read.repetitions_most != wanted.repetitions_most ||
      read.order.remount_each_repetition != wanted.order.remount_each_repetition ||
      read.profile.until != wanted.profile.until || read.profile.steps != wanted.profile.steps ||
      read.profile.dwell.value() != wanted.profile.dwell.value() || read.zero.value() != wanted.zero.value())
    throw ConfigurationError(campaign.path +
                             ": its layout does not let the new values in; write each key on a line of its own");
  return editor.text();
}

}  // namespace kphi::profiles
