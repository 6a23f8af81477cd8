// Records as a line of text, and counters as words.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "drivers/netbox/stream/reorder_window.hpp"

namespace kphi::netbox::test {

struct Step {
  enum class Kind { record, wait_ms, drops, expire, flush, segment };
  Kind kind;
  std::uint32_t number = 0;  ///< rdt, milliseconds, datagrams
  std::uint32_t ft = 0;
  bool taken = true;

  [[nodiscard]] LoadCellRecord record(Instant arrival) const { return {{}, number, ft, 0, arrival.count()}; }
};

/// "3": rdt 3, ft 1003. "3@70": ft 70. "3..9@70": and the next ones, "/2": 2 of ft apart instead of `stride`. "!"
/// behind it: refused. "+20": 20 ms pass. "drop2": datagrams dropped by the host. "expire", "flush", "segment".
inline std::vector<Step> steps_of(const std::string& feed, unsigned stride = 1) {
  using Kind = Step::Kind;
  std::vector<Step> steps;
  std::istringstream words(feed);
  for (std::string word; words >> word;) {
    const auto number = [&](std::size_t at) {
      return static_cast<std::uint32_t>(std::stoll(word.substr(at), nullptr, 0));
    };
    if (word == "expire" || word == "flush" || word == "segment") {
      steps.push_back({word == "expire" ? Kind::expire : word == "flush" ? Kind::flush : Kind::segment});
    } else if (word[0] == '+') {
      steps.push_back({Kind::wait_ms, number(1)});
    } else if (word.starts_with("drop")) {
      steps.push_back({Kind::drops, number(4)});
    } else {
      const auto dots = word.find(".."), at = word.find('@'), slash = word.find('/');
      const std::uint32_t first = number(0), last = dots == std::string::npos ? first : number(dots + 2);
      const std::uint32_t ft = at == std::string::npos ? first + 1000 : number(at + 1);
      const std::uint32_t apart = slash == std::string::npos ? stride : number(slash + 1);
      for (std::uint32_t i = 0; i <= last - first; ++i)
        steps.push_back({Kind::record, first + i, ft + i * apart, word.back() != '!'});
    }
  }
  return steps;
}

/// The account adds up.
inline void expect_closed(const Counters& c) { EXPECT_EQ(c.expected, c.received + c.lost_network + c.lost_host); }

/// "lost 1, late 2": what is not zero.
inline std::string words_of(const Counters& counters) {
  constexpr std::pair<const char*, std::uint64_t Counters::*> kNames[] = {
      {"lost", &Counters::lost_network},   {"host", &Counters::lost_host},      {"duplicates", &Counters::duplicates},
      {"late", &Counters::late},           {"reordered", &Counters::reordered}, {"stalled", &Counters::stalled},
      {"irregular", &Counters::irregular}, {"restarts", &Counters::restarts},   {"reboots", &Counters::reboots}};
  std::string words;
  for (const auto& [name, counter] : kNames) {
    if (counters.*counter == 0) continue;
    words += (words.empty() ? "" : ", ") + std::string(name) + " " + std::to_string(counters.*counter);
  }
  return words;
}

}  // namespace kphi::netbox::test
