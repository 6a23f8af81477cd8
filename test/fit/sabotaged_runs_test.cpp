// Campaign folders in which somebody changed, lost or mixed up files, one way each: what is fitted from them is
// refused, and the file is named. And motors that turn the wrong way.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <random>

#include "base/error.hpp"
#include "daq/campaign/campaign_run.hpp"
#include "daq/guard/cell_trust.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "results/campaign_folder.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::fit {
namespace sabotaged_runs_test {

namespace fs = std::filesystem;

using Dice = std::mt19937_64;

fs::path campaign(const fs::path& folder, int seed) {
  const profiles::BenchConfig config = test::deterministic_config(seed);
  daq::DeterministicBench bench(config, sim::BenchSettings{});
  const auto results = results::CampaignFolder::create(folder, "20210530T000000Z", fmt::format("c{}", seed));
  daq::AutoConfirmOperator person;
  daq::Progress silence;
  (void)daq::run_campaign(bench, test::short_campaign("0, 90", 2), config, results, person, silence, test::never);
  return results.path();
}

fs::path a_run(const fs::path& folder, Dice& dice, std::size_t apart_from = 99) {
  const auto runs = results::CampaignFolder::open(folder).complete_runs();
  std::size_t chosen = apart_from;
  while (chosen == apart_from) chosen = std::uniform_int_distribution<std::size_t>(0, runs.size() - 1)(dice);
  return runs[chosen];
}

void write(const fs::path& file, const std::string& bytes) {
  fs::permissions(file, fs::perms::owner_write, fs::perm_options::add);
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}

std::size_t place_in(const std::string& bytes, Dice& dice) {
  return std::uniform_int_distribution<std::size_t>(0, bytes.size() - 1)(dice);
}

void flip_a_byte(const fs::path& file, Dice& dice) {
  std::string bytes = test::bytes_of(file);
  bytes[place_in(bytes, dice)] ^= static_cast<char>(1 << std::uniform_int_distribution<int>(0, 7)(dice));
  write(file, bytes);
}

/// A digit of the table becomes the next one.
void edit_a_number(const fs::path& file, Dice& dice) {
  std::string bytes = test::bytes_of(file);
  std::size_t place = place_in(bytes, dice);
  while (bytes[place] < '0' || bytes[place] > '8') place = place_in(bytes, dice);
  ++bytes[place];
  write(file, bytes);
}

/// `from` is in it once.
void edit(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = test::bytes_of(file);
  write(file, text.replace(text.find(from), from.size(), to));
}

struct Damage {
  const char* name;
  /// Of the folder; `other` is a campaign of another day.
  std::function<void(const fs::path& folder, const fs::path& other, Dice& dice)> make;
  const char* named_as;  ///< part of what is said
};

const std::vector<Damage>& damages() {
  static const std::vector<Damage> all{
      {"one bit of a run", [](auto& folder, auto&, Dice& dice) { flip_a_byte(a_run(folder, dice), dice); }, ".h5"},
      {"a run that is cut off",
       [](auto& folder, auto&, Dice& dice) {
         const fs::path run = a_run(folder, dice);
         fs::permissions(run, fs::perms::owner_write, fs::perm_options::add);
         fs::resize_file(run, fs::file_size(run) / 2);
       },
       ".h5"},
      {"an empty run", [](auto& folder, auto&, Dice& dice) { write(a_run(folder, dice), ""); }, ".h5"},
      {"a run that is gone", [](auto& folder, auto&, Dice& dice) { fs::remove(a_run(folder, dice)); }, ".h5"},
      {"two runs exchanged",
       [](auto& folder, auto&, Dice& dice) {
         const auto runs = results::CampaignFolder::open(folder).complete_runs();
         const std::size_t one = std::uniform_int_distribution<std::size_t>(0, runs.size() - 2)(dice);
         const std::string bytes = test::bytes_of(runs[one]);
         write(runs[one], test::bytes_of(runs[one + 1]));
         write(runs[one + 1], bytes);
       },
       ".h5"},
      {"a run of another campaign",
       [](auto& folder, auto& other, Dice& dice) {
         const fs::path run = a_run(folder, dice);
         write(run, test::bytes_of(other / "runs" / run.filename()));
       },
       ".h5"},
      {"a number of steps.csv", [](auto& folder, auto&, Dice& dice) { edit_a_number(folder / "steps.csv", dice); },
       "steps.csv"},
      {"the steps of another campaign",
       [](auto& folder, auto& other, Dice&) { write(folder / "steps.csv", test::bytes_of(other / "steps.csv")); },
       "steps.csv"},
      {"a number of the journal",
       [](auto& folder, auto&, Dice& dice) { edit_a_number(folder / "journal.jsonl", dice); }, "journal"},
      {"the journal of another campaign",
       [](auto& folder, auto& other, Dice&) {
         write(folder / "journal.jsonl", test::bytes_of(other / "journal.jsonl"));
       },
       ""},
      {"another campaign file",
       [](auto& folder, auto&, Dice&) { edit(folder / "campaign.yaml", "diameter_in: 5", "diameter_in: 6"); },
       "campaign.yaml"},
      {"another bench file", [](auto& folder, auto&, Dice&) { edit(folder / "bench.yaml", "spin: +1", "spin: -1"); },
       "bench.yaml"},
  };
  return all;
}

TEST(SabotagedRuns, AreRefusedByName) {
  constexpr unsigned kEach = 10;
  const test::TemporaryFolder folder;
  const fs::path whole = campaign(folder.path(), 3), other = campaign(folder.path(), 4);
  ASSERT_NO_THROW(results::require_intact(results::CampaignFolder::open(whole)));
  unsigned told = 0, all = 0;
  for (const Damage& damage : damages()) {
    for (unsigned seed = 1; seed <= kEach; ++seed) {
      const fs::path copy = folder.path() / "copy";
      fs::remove_all(copy);
      fs::copy(whole, copy, fs::copy_options::recursive);
      Dice dice(seed);
      damage.make(copy, other, dice);
      const std::string said = test::words_of<Error>([&] {
        results::require_intact(results::CampaignFolder::open(copy));
        return 0;
      });
      const bool named = !said.empty() && said.find(damage.named_as) != std::string::npos;
      EXPECT_TRUE(named) << damage.name << ": \"" << said << "\"";
      told += named ? 1 : 0;
      ++all;
    }
  }
  fmt::print("told {} of {}\n", told, all);
}

// A bench whose motor turns the other way than its file says, whose propeller pushes, whose axis is mirrored: its first
// settled step stops the run.
TEST(SabotagedRuns, AreStoppedIfTheMotorTurnsTheWrongWay) {
  struct Wrong {
    double thrust, torque;
    const char* named_as;
  };
  for (const Wrong& wrong : {Wrong{1, 1, "turns the other way than spin"},
                             {-1, -1, "the propeller pushes"},
                             {-1, 1, "mirror thrust_axis"}}) {
    for (int spin : {1, -1}) {
      for (const double thrust : {0.8, 2.0, 5.0, 9.0, 14.0}) {
        const auto doubt = daq::doubt_about_signs(wrong.thrust * thrust, wrong.torque * spin * 0.0128 * thrust, spin);
        ASSERT_TRUE(doubt) << thrust;
        EXPECT_NE(doubt->find(wrong.named_as), std::string::npos) << *doubt;
      }
    }
  }
}

}  // namespace sabotaged_runs_test
}  // namespace kphi::fit
