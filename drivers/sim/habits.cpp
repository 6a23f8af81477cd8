#include "drivers/sim/habits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "drivers/sim/fault_entry.hpp"

namespace kphi::sim {
namespace {

using Words = std::array<std::string_view, 3>;

struct Habit {
  std::string_view name;
  bool NetBoxHabits::*flag = nullptr;
  void (*set)(NetBoxHabits& habits, int index) = nullptr;  ///< of the word
  Words words{"false", "true", ""};
};

constexpr std::string_view kFirstRdt = "first_rdt_sequence";

using H = NetBoxHabits;
constexpr std::array<Habit, 18> kHabits{{
    {"bias_stops_stream", &H::bias_stops_stream},
    {"bias_vector_survives", &H::bias_vector_survives},
    {"software_bias_survives", &H::software_bias_survives},
    {"software_bias_in_setbias", &H::software_bias_in_setbias},
    {"rate_write", nullptr, [](H& h, int i) { h.rate_write = static_cast<H::RateWrite>(i); },
     Words{"stops", "continues", "pauses"}},
    {"last_block", nullptr, [](H& h, int i) { h.last_block = static_cast<H::LastBlock>(i); },
     Words{"partial", "padded", "dropped"}},
    {"command_one_streams", &H::command_one_streams},
    {"command_four_streams", &H::command_four_streams},
    {"ft_counts_samples", &H::ft_counts_samples},
    {"torque_text_with_hyphen", &H::torque_text_with_hyphen},
    {"flags_as_digits", &H::flags_as_digits},
    {"array_separator", nullptr, [](H& h, int i) { h.array_separator = ";, "[i]; },
     Words{"semicolon", "comma", "blank"}},
    {"product_name", &H::product_name},
    {"axia", &H::axia},
    {"close_on_unknown_tcp", &H::close_on_unknown_tcp},
    {"only_three_writes", &H::only_three_writes},
    {"readft_sets_conditions", &H::readft_sets_conditions},
    {"one_http_connection", &H::one_http_connection},
}};

std::string known_names() {
  std::string names(kFirstRdt);
  for (const Habit& habit : kHabits) names += fmt::format(", {}", habit.name);
  return names;
}

}  // namespace

void set_habit(NetBoxHabits& habits, const std::string& name, const std::string& value) {
  if (name == kFirstRdt) {
    habits.first_rdt_sequence = static_cast<std::uint32_t>(fault_number(name, value, {0, 4294967295.0, true}));
    return;
  }
  const auto habit = std::find_if(kHabits.begin(), kHabits.end(), [&](const Habit& h) { return h.name == name; });
  if (habit == kHabits.end())
    throw FaultEntryError(name, fmt::format("no habit is called '{}'; there are {}", name, known_names()));
  const auto word = std::find(habit->words.begin(), habit->words.end(), value);
  if (value.empty() || word == habit->words.end()) {
    const bool three = !habit->words[2].empty();
    throw FaultEntryError(name, fmt::format("'{}' is neither {}{}{} nor {}", value, habit->words[0], three ? ", " : "",
                                            three ? habit->words[1] : "", habit->words[three ? 2 : 1]));
  }
  const auto index = static_cast<int>(word - habit->words.begin());
  if (habit->flag != nullptr) {
    habits.*(habit->flag) = index == 1;
  } else {
    habit->set(habits, index);
  }
}

}  // namespace kphi::sim
