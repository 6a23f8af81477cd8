#include "profiles/strict_yaml.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>

#include "profiles/yaml_text.hpp"

namespace kphi::profiles {
namespace {

bool lies_in(const std::string& pointer, const std::string& root) {
  return pointer.compare(0, root.size(), root) == 0 && (pointer.size() == root.size() || pointer[root.size()] == '/');
}

void copy_marks(std::map<std::string, Mark>& marks, const std::string& from, const std::string& to) {
  std::vector<std::pair<std::string, Mark>> copies;
  for (auto it = marks.lower_bound(from); it != marks.end() && it->first.compare(0, from.size(), from) == 0; ++it) {
    if (lies_in(it->first, from)) copies.emplace_back(to + it->first.substr(from.size()), it->second);
  }
  for (auto& [pointer, mark] : copies) marks.emplace(std::move(pointer), mark);
}

/// Builds the JSON from yaml-cpp's events. Not from its nodes: those expand aliases and drop duplicate keys.
class Builder final : public YAML::EventHandler {
 public:
  Builder(const std::string& text, const std::string& path) : lines_(text) { document_.path = path; }

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
    std::string key;
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
    document_.findings.push_back({lines_.mark(mark.line, mark.column), pointer, what, next_move});
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
    document_.key_marks.emplace(pointer, lines_.mark(mark.line, mark.column));
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
    document_.value_marks.emplace(pointer, lines_.mark(mark.line, mark.column));
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
    Frame frame;
    frame.value = std::move(empty);
    frame.pointer = pointer;
    frame.anchor = anchor;
    stack_.push_back(std::move(frame));
  }

  void close() {
    Frame frame = std::move(stack_.back());
    stack_.pop_back();
    end(std::move(frame.value), frame.pointer, frame.anchor, frame.values);
  }

  Lines lines_;
  SourceDocument document_;
  std::vector<Frame> stack_;
  std::map<YAML::anchor_t, Anchored> anchors_;
  int values_ = 0;
  bool started_ = false;
};

[[noreturn]] void refuse(const std::string& path, Mark mark, const std::string& what, const std::string& next_move) {
  throw RefusedFile(path, {{mark, "", what, next_move}});
}

std::string without_byte_order_mark(const std::string& text) {
  return text.compare(0, 3, "\xEF\xBB\xBF") == 0 ? text.substr(3) : text;
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
  const std::string text = without_byte_order_mark(whole_text);
  if (text.size() > kMaxTextBytes) refuse(path, {}, "larger than 1 MiB", "check that this is the right file");
  if (const auto fault = first_fault_of_characters(text)) refuse(path, fault->mark, fault->what, fault->next_move);

  Builder builder(text, path);
  std::istringstream stream(text);
  try {
    YAML::Parser parser(stream);
    if (!parser.HandleNextDocument(builder)) {
      refuse(path, {}, "the file is empty", "start from a copy of one of the shipped files");
    }
    parser.HandleNextDocument(builder);
  } catch (const YAML::Exception& fault) {
    const Lines lines(text);
    refuse(path, fault.mark.is_null() ? Mark{} : lines.mark(fault.mark.line, fault.mark.column),
           fmt::format("not readable as YAML: {}", fault.msg), "check colons, brackets and indentation here and above");
  }
  return builder.take();
}

std::string read_text(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw ConfigurationError(fmt::format("{}: cannot be opened: {}; check the name", path, std::strerror(errno)));
  std::string text(kMaxTextBytes + 1, '\0');
  errno = 0;
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad() || (file.gcount() == 0 && errno != 0)) {
    throw ConfigurationError(fmt::format("{}: cannot be read: {}; name a file", path, std::strerror(errno)));
  }
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kMaxTextBytes) {
    throw ConfigurationError(fmt::format("{}: larger than 1 MiB; check that this is the right file", path));
  }
  return text;
}

std::string child_pointer(const std::string& pointer, const std::string& key) {
  std::string result = pointer + '/';
  for (const char c : key) {
    if (c == '~') {
      result += "~0";
    } else if (c == '/') {
      result += "~1";
    } else {
      result += c;
    }
  }
  return result;
}

std::string dotted(const std::string& pointer) {
  std::string result;
  std::size_t begin = 1;
  while (begin <= pointer.size() && !pointer.empty()) {
    const std::size_t end = std::min(pointer.find('/', begin), pointer.size());
    std::string token = pointer.substr(begin, end - begin);
    const bool is_index = !token.empty() && token.find_first_not_of("0123456789") == std::string::npos;
    for (const auto& [escaped, plain] : {std::pair{"~1", "/"}, std::pair{"~0", "~"}}) {
      for (auto at = token.find(escaped); at != std::string::npos; at = token.find(escaped, at + 1)) {
        token.replace(at, 2, plain);
      }
    }
    result += is_index ? "[" + token + "]" : (result.empty() ? "" : ".") + token;
    begin = end + 1;
  }
  return result;
}

}  // namespace kphi::profiles
