#include "drivers/sim/netbox/settings.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "drivers/sim/script/faults.hpp"

namespace kphi::sim {
namespace {

struct QuirkRow {
  std::string_view name;
  void (*set)(NetBoxQuirks& quirks, int index);  ///< of the word
  std::array<std::string_view, 3> words{"false", "true", ""};
};

using Q = NetBoxQuirks;

template <bool Q::*Flag>
constexpr QuirkRow flag(std::string_view name) {
  return {name, [](Q& quirks, int index) { quirks.*Flag = index == 1; }};
}

constexpr std::array<QuirkRow, 9> kQuirks{{
    flag<&Q::bias_stops_stream>("bias_stops_stream"),
    {"rate_write", [](Q& q, int i) { q.rate_write = static_cast<Q::RateWrite>(i); }, {"stops", "continues", "pauses"}},
    {"last_block", [](Q& q, int i) { q.last_block = static_cast<Q::LastBlock>(i); }, {"partial", "padded", "dropped"}},
    flag<&Q::torque_text_with_hyphen>("torque_text_with_hyphen"),
    flag<&Q::flags_as_digits>("flags_as_digits"),
    {"array_separator", [](Q& q, int i) { q.array_separator = ";, "[i]; }, {"semicolon", "comma", "blank"}},
    flag<&Q::axia>("axia"),
    flag<&Q::only_three_writes>("only_three_writes"),
    {"served",
     [](Q& q, int i) { q.served = static_cast<Q::Served>(i); },
     {"all", "three_then_closed", "three_then_503"}},
}};

}  // namespace

void set_quirk(NetBoxQuirks& quirks, const std::string& name, const std::string& value) {
  const auto quirk = std::ranges::find(kQuirks, name, &QuirkRow::name);
  if (quirk == kQuirks.end()) {
    std::vector<std::string_view> known;
    for (const QuirkRow& row : kQuirks) known.push_back(row.name);
    throw FaultEntryError(name, fmt::format("unknown quirk \"{}\"; known: {}", name, fmt::join(known, ", ")));
  }
  std::vector<std::string_view> words(quirk->words.begin(), quirk->words.end());
  if (words.back().empty()) words.pop_back();
  const auto word = std::ranges::find(words, value);
  if (word == words.end())
    throw FaultEntryError(name, fmt::format("\"{}\" is not one of {}", value, fmt::join(words, ", ")));
  quirk->set(quirks, static_cast<int>(word - words.begin()));
}

}  // namespace kphi::sim
