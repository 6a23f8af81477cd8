#include "profiles/strict_yaml.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <boost/algorithm/string/case_conv.hpp>
#include <boost/locale/utf.hpp>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <regex>
#include <sstream>
#include <string_view>

#include "base/number.hpp"
#include "base/text.hpp"

namespace kphi::profiles {
namespace {

constexpr const char* kRunFile = "this is a run file (HDF5), not YAML";
constexpr const char* kRunFileNext = "`kphi info` shows it, `kphi verify` checks it";

/// Turns bytes of a text into places.
class Lines {
 public:
  explicit Lines(const std::string& text) : text_(text) {
    for (std::size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at + 1))
      begins_.push_back(at + 1);
  }
  [[nodiscard]] Mark mark(std::size_t offset) const {
    const auto line = std::prev(std::ranges::upper_bound(begins_, std::min(offset, text_.size())));
    const auto before = std::string_view(text_).substr(*line, std::min(offset, text_.size()) - *line);
    const auto continued = std::ranges::count_if(before, is_continuation);
    return {static_cast<int>(line - begins_.begin()) + 1,
            static_cast<int>(before.size()) - static_cast<int>(continued) + 1};
  }

 private:
  const std::string& text_;
  std::vector<std::size_t> begins_{0};
};

struct BadCharacter {
  std::size_t offset = 0;
  std::string what;
};

/// First control character or broken UTF-8 sequence; tabs and line ends are allowed.
std::optional<BadCharacter> first_bad_character(const std::string& text) {
  namespace utf = boost::locale::utf;
  for (auto at = text.begin(); at != text.end();) {
    const auto begin = at;
    const utf::code_point c = utf::utf_traits<char>::decode(at, text.end());
    const auto offset = static_cast<std::size_t>(begin - text.begin());
    if (c == utf::illegal || c == utf::incomplete) return BadCharacter{offset, "a byte sequence that is not UTF-8"};
    const bool is_line_end = c == '\n' || (c == '\r' && at != text.end() && *at == '\n');
    if ((c < 0x20 && c != '\t' && !is_line_end) || (c >= 0x7F && c < 0xA0))
      return BadCharacter{offset, fmt::format("a control character (0x{:02x})", c)};
  }
  return std::nullopt;
}

std::optional<std::size_t> first_tab_in_indentation(const std::string& text) {
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::size_t word = std::min(text.find_first_not_of(" \t\r", begin), end);
    const std::size_t tab = text.find('\t', begin);
    if (word < end && text[word] != '#' && tab < word) return tab;
    begin = end + 1;
  }
  return std::nullopt;
}

struct Scalar {
  nlohmann::json value;  ///< null if refused
  std::string what;      ///< why it is refused; empty if it is not
  std::string next_move;
};

/// `digits` has no sign. Why other readers, or the reader of this page, may see another number in it.
std::optional<std::string> doubtful_number(const std::string& digits) {
  static const std::pair<std::regex, const char*> kDoubts[] = {
      {std::regex("0[0-9][0-9.eE+_-]*"), "looks octal"},
      {std::regex("0[xX][0-9a-fA-F_]*|0[oO][0-7_]*|0[bB][01_]*"), "is not decimal"},
      {std::regex("[0-9][0-9.]*(_[0-9_.]*|,[0-9,.]*)"), "has separators"},
      {std::regex("[0-9]+:[0-9:]*"), "is base 60 to some readers"}};
  for (const auto& [form, words] : kDoubts)
    if (std::regex_match(digits, form)) return words;
  return std::nullopt;
}

/// An unquoted scalar.
Scalar read_plain_scalar(const std::string& text) {
  static const std::regex kBooleanElsewhere("yes|no|on|off|y|n|true|false");
  static const std::regex kNotFinite("[+-]?([.]?(inf|nan)|infinity)");
  static const std::regex kDecimal("([0-9]+[.]?[0-9]*|[.][0-9]+)([eE][+-]?[0-9]+)?");
  if (text == "true" || text == "false") return {text == "true", "", ""};
  const std::string word = boost::algorithm::to_lower_copy(text);
  if (std::regex_match(word, kBooleanElsewhere)) {
    return {nullptr, fmt::format("{} is a boolean to some YAML readers and text to others", text),
            fmt::format("write true or false, or quote it: \"{}\"", text)};
  }
  const Scalar not_finite{nullptr, fmt::format("{} is not a finite number", text), "write a finite number"};
  if (std::regex_match(word, kNotFinite)) return not_finite;

  const bool has_sign = text[0] == '+' || text[0] == '-';
  const std::string digits = text.substr(has_sign ? 1 : 0);
  if (const auto doubt = doubtful_number(digits)) {
    return {nullptr, fmt::format("{} {}", text, *doubt), "write a plain decimal number, or quote it if it is text"};
  }
  if (!std::regex_match(digits, kDecimal)) return {text, "", ""};
  const int sign = text[0] == '-' ? -1 : 1;
  if (const auto whole = parse_integer<std::int64_t>(digits)) return {sign * *whole, "", ""};
  if (const auto number = parse_double(digits)) return {sign * *number, "", ""};
  return not_finite;
}

/// Puts the findings in the order of the file.
std::string sort_and_describe(const std::string& path, std::vector<FileFinding>& findings) {
  std::ranges::stable_sort(findings, {},
                           [](const FileFinding& one) { return std::pair(one.mark.line, one.mark.column); });
  std::string lines;
  for (std::size_t i = 0; i < std::min(findings.size(), RefusedFile::kShownFindings); ++i)
    lines += (i == 0 ? "" : "\n") + describe(path, findings[i]);
  if (findings.size() > RefusedFile::kShownFindings)
    lines +=
        fmt::format("\n{}: {} more problems; fix these first", path, findings.size() - RefusedFile::kShownFindings);
  return lines;
}

/// Marks of a value, and of all in it, also for a second place.
void copy_marks(std::map<std::string, Mark>& marks, const std::string& from, const std::string& to) {
  const std::map copies(marks.lower_bound(from), marks.lower_bound(from + "0"));  // '0' follows '/'
  for (const auto& [pointer, mark] : copies) {
    const std::string below = pointer.substr(from.size());
    if (below.empty() || below[0] == '/') marks.emplace(to + below, mark);
  }
}

/// Builds the JSON from yaml-cpp's events. Not from its nodes: those expand aliases and drop duplicate keys.
class Builder final : public YAML::EventHandler {
 public:
  Builder(const Lines& lines, const std::string& path) : lines_(lines) { document_.path = path; }

  SourceDocument take() { return std::move(document_); }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (started_) {
      stop(mark, "a second document follows", "keep one document per file; look for a stray --- or bracket");
    }
    started_ = true;
  }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    refuse_as_key(mark);
    const std::string pointer = begin(mark);
    // An empty value has the mark of whatever follows: its key is the place to look at.
    if (const auto key = document_.key_marks.find(pointer); key != document_.key_marks.end()) {
      document_.value_marks[pointer] = key->second;
    }
    end(nullptr, pointer, anchor, 1);
  }

  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& text) override {
    if (text.size() > kMaxScalarBytes) {
      stop(mark, fmt::format("this text has {} bytes, the limit is {}", text.size(), kMaxScalarBytes), "shorten it");
    }
    if (const auto fault = first_bad_character(text)) stop(mark, fault->what, "write it without");
    if (awaits_key()) return take_key(mark, text);
    const std::string pointer = begin(mark);
    refuse_tag(mark, tag, pointer);
    if (tag != "?") return end(text, pointer, anchor, 1);
    Scalar scalar = read_plain_scalar(text);
    if (!scalar.what.empty()) add(mark, pointer, scalar.what, scalar.next_move);
    end(std::move(scalar.value), pointer, anchor, 1);
  }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    refuse_as_key(mark);
    const auto target = anchors_.find(anchor);
    if (target == anchors_.end())
      stop(mark, "this alias names a key, or a value that contains it", "write the value out");
    count(mark, target->second.values);
    const std::string pointer = next_pointer();
    copy_marks(document_.value_marks, target->second.pointer, pointer);
    copy_marks(document_.key_marks, target->second.pointer, pointer);
    auto value = target->second.value;
    end(std::move(value), pointer, 0, target->second.values);
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, nlohmann::json::array());
  }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, nlohmann::json::object());
  }
  void OnSequenceEnd() override { close(); }
  void OnMapEnd() override { close(); }

 private:
  struct Frame {
    nlohmann::json value;
    std::string pointer;
    YAML::anchor_t anchor = 0;
    std::string key{};
    bool has_key = false;
    bool is_duplicate = false;
    int values = 1;
  };
  struct Anchored {
    nlohmann::json value;
    std::string pointer;
    int values = 1;
  };

  [[noreturn]] void stop(const YAML::Mark& mark, const std::string& what, const std::string& next_move) {
    add(mark, "", what, next_move);
    throw RefusedFile(document_.path, document_.findings);
  }

  void add(const YAML::Mark& mark, const std::string& pointer, const std::string& what, const std::string& next_move) {
    document_.findings.push_back({lines_.mark(static_cast<std::size_t>(mark.pos)), pointer, what, next_move});
  }

  bool awaits_key() const { return !stack_.empty() && stack_.back().value.is_object() && !stack_.back().has_key; }

  void refuse_as_key(const YAML::Mark& mark) {
    if (awaits_key()) stop(mark, "a key must be a word", "write key: value");
  }

  void refuse_tag(const YAML::Mark& mark, const std::string& tag, const std::string& pointer) {
    if (tag == "?" || tag == "!" || tag.empty()) return;
    add(mark, pointer, fmt::format("the tag {} is not supported", tag), "write the value without a tag");
  }

  void take_key(const YAML::Mark& mark, const std::string& key) {
    if (key.size() > kMaxKeyBytes) stop(mark, "this key is too long", "shorten it");
    if (key == "<<") stop(mark, "merge keys are not supported", "write the keys out");
    Frame& frame = stack_.back();
    const std::string pointer = child_pointer(frame.pointer, key);
    frame.key = key;
    frame.has_key = true;
    frame.is_duplicate = frame.value.contains(key);
    if (frame.is_duplicate) {
      add(mark, pointer,
          fmt::format("{} is already given on line {}", dotted(pointer), document_.key_mark(pointer).line),
          "keep one of the two");
      return;
    }
    document_.key_marks.emplace(pointer, lines_.mark(static_cast<std::size_t>(mark.pos)));
  }

  std::string next_pointer() const {
    if (stack_.empty()) return "";
    const Frame& frame = stack_.back();
    return child_pointer(frame.pointer, frame.value.is_array() ? std::to_string(frame.value.size()) : frame.key);
  }

  void count(const YAML::Mark& mark, int values) {
    values_ += values;
    if (values_ > kMaxValues) stop(mark, fmt::format("more than {} values", kMaxValues), "make the file smaller");
  }

  std::string begin(const YAML::Mark& mark) {
    count(mark, 1);
    std::string pointer = next_pointer();
    document_.value_marks.emplace(pointer, lines_.mark(static_cast<std::size_t>(mark.pos)));
    return pointer;
  }

  void end(nlohmann::json value, const std::string& pointer, YAML::anchor_t anchor, int values) {
    if (anchor != 0) anchors_[anchor] = {value, pointer, values};
    if (stack_.empty()) {
      document_.value = std::move(value);
      return;
    }
    Frame& frame = stack_.back();
    frame.values += values;
    if (frame.value.is_array()) {
      frame.value.push_back(std::move(value));
    } else if (!frame.is_duplicate) {
      frame.value[frame.key] = std::move(value);
    }
    frame.has_key = false;
  }

  void open(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, nlohmann::json empty) {
    refuse_as_key(mark);
    const std::string pointer = begin(mark);
    refuse_tag(mark, tag, pointer);
    if (stack_.size() >= kMaxDepth) stop(mark, fmt::format("nested deeper than {}", kMaxDepth), "make it flatter");
    stack_.push_back({std::move(empty), pointer, anchor});
  }

  void close() {
    Frame frame = std::move(stack_.back());
    stack_.pop_back();
    end(std::move(frame.value), frame.pointer, frame.anchor, frame.values);
  }

  const Lines& lines_;
  SourceDocument document_;
  std::vector<Frame> stack_;
  std::map<YAML::anchor_t, Anchored> anchors_;
  int values_ = 0;
  bool started_ = false;
};

[[noreturn]] void refuse(const std::string& path, Mark mark, const std::string& what, const std::string& next_move) {
  throw RefusedFile(path, {{mark, "", what, next_move}});
}

}  // namespace

Mark SourceDocument::value_mark(std::string pointer) const {
  while (true) {
    if (const auto it = value_marks.find(pointer); it != value_marks.end()) return it->second;
    if (pointer.empty()) return {};
    pointer.resize(pointer.rfind('/'));
  }
}

Mark SourceDocument::key_mark(const std::string& pointer) const {
  const auto it = key_marks.find(pointer);
  return it != key_marks.end() ? it->second : value_mark(pointer);
}

SourceDocument parse_strict_yaml(const std::string& whole_text, const std::string& path) {
  const bool has_byte_order_mark = whole_text.starts_with("\xEF\xBB\xBF");
  const std::string text = whole_text.substr(has_byte_order_mark ? 3 : 0);
  if (text.size() > kMaxTextBytes) refuse(path, {}, "larger than 1 MiB", "check that this is the right file");
  if (text.starts_with("\x89HDF")) refuse(path, {}, kRunFile, kRunFileNext);
  if (const auto first = text.substr(0, text.find('\n')); first.find_first_of(",;\t") < first.find_first_of(":#{["))
    refuse(path, {}, "this is a table, not YAML",
           "`kphi fit` takes steps and tables of k, `kphi import` logs of a stand");
  const Lines lines(text);
  if (const auto bad = first_bad_character(text))
    refuse(path, lines.mark(bad->offset), bad->what, "save the file as UTF-8 text");
  if (const auto tab = first_tab_in_indentation(text))
    refuse(path, lines.mark(*tab), "a tab in the indentation", "indent with spaces");

  Builder builder(lines, path);
  std::istringstream stream(text);
  try {
    YAML::Parser parser(stream);
    if (!parser.HandleNextDocument(builder)) {
      refuse(path, {}, "the file is empty", "start from a copy of one of the shipped files");
    }
    parser.HandleNextDocument(builder);
  } catch (const YAML::Exception& fault) {
    refuse(path, fault.mark.is_null() ? Mark{} : lines.mark(static_cast<std::size_t>(fault.mark.pos)),
           fmt::format("not readable as YAML: {}", fault.msg), "check colons, brackets and indentation here and above");
  }
  return builder.take();
}

std::string read_text(const std::string& path) {
  try {
    return read_text_file(path, kMaxTextBytes);
  } catch (const std::runtime_error& error) {
    // Most are larger than any YAML may be.
    if (std::error_code none; path.ends_with(".h5") && std::filesystem::is_regular_file(path, none))
      refuse(path, {}, kRunFile, kRunFileNext);
    throw ConfigurationError(fmt::format("{}: {}", path, error.what()));
  }
}

std::string child_pointer(const std::string& pointer, const std::string& key) {
  return (nlohmann::json::json_pointer(pointer) / key).to_string();
}

std::string dotted(const std::string& pointer) {
  std::string result;
  for (nlohmann::json::json_pointer at(pointer); !at.empty(); at.pop_back()) {
    const std::string& token = at.back();
    const bool is_index = !token.empty() && token.find_first_not_of("0123456789") == std::string::npos;
    const bool is_first = at.parent_pointer().empty();
    result.insert(0, is_index ? "[" + token + "]" : (is_first ? "" : ".") + token);
  }
  return result;
}

std::string describe(const std::string& path, const FileFinding& finding) {
  return fmt::format("{}:{}:{}: {}", path, finding.mark.line, finding.mark.column, finding.words());
}

RefusedFile::RefusedFile(const std::string& path, std::vector<FileFinding> findings)
    : ConfigurationError(sort_and_describe(path, findings)), findings_(std::move(findings)) {}

}  // namespace kphi::profiles
