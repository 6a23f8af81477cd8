#include "daq/guard/run_stopped.hpp"

#include <fmt/format.h>

namespace kphi::daq {

void StopWords::also(const std::string& text) {
  if (text.empty()) return;
  const std::size_t time_ends = text.find(" s: ");
  const bool has_time = time_ends != std::string::npos && text.find_first_not_of("0123456789.") == time_ends;
  const std::string what = has_time ? text.substr(time_ends + 4) : text;
  if (cause.find(what) == std::string::npos && what.find(cause) == std::string::npos) add_words(consequences, what);
}

std::string StopWords::line() const {
  std::string line = cause;
  for (const std::string* more : {&consequences, &state}) {
    if (!more->empty()) line += "; " + *more;
  }
  return line;
}

std::string StopWords::text(const std::string& headline) const {
  std::string text = fmt::format("{}: {}\n", headline, cause);
  const auto add = [&](const char* what, const std::string& words) {
    if (!words.empty()) text += fmt::format("  {:<6} {}\n", what, words);
  };
  add("also:", consequences);
  add("next:", next_move);
  add("data:", data);
  if (!state.empty()) text += "  " + state + "\n";
  return text;
}

StopWords words_of(const std::exception_ptr& cause) {
  try {
    std::rethrow_exception(cause);
  } catch (const RunStopped& e) {
    return e.words();
  } catch (const std::exception& e) {
    return {e.what(), {}, {}, {}, {}};
  } catch (...) {
    return {"unknown", {}, {}, {}, {}};
  }
}

void add_words(std::string& said, const std::string& text) {
  if (text.empty() || said.find(text) != std::string::npos) return;
  said += (said.empty() ? "" : "; ") + text;
}

}  // namespace kphi::daq
