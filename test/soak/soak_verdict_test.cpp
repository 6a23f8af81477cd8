// The verdict of the soak can fail: each of its checks is shown a campaign in which just that is wrong, and names it.
#include "test/soak/soak_verdict.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>

#include "results/file_layer.hpp"

namespace kphi::soak::soak_verdict_test {

using namespace std::chrono_literals;
using results::QualityFlag;
namespace fs = std::filesystem;

constexpr const char* kNoFaults = "format: kphi-faults/1\nfaults:\n  []\n";

/// With a supply and a sensor of the air; nothing goes wrong.
Mixture clean_mixture() {
  for (std::uint64_t seed = 1;; ++seed) {
    Mixture mixture = draw(seed);
    const auto has = [&](const char* device) { return mixture.bench.find(device) != std::string::npos; };
    if (!mixture.answers_are_good || mixture.mounted_instead_deg || !has("supply: ") || !has("ambient: ")) continue;
    mixture.faults = kNoFaults;
    mixture.disk.reset();
    mixture.kill.reset();
    mixture.interrupt.reset();
    mixture.absence.reset();
    return mixture;
  }
}

Mixture with_fault(const std::string& fault) {
  Mixture mixture = clean_mixture();
  mixture.faults = "format: kphi-faults/1\nfaults:\n  - {" + fault + "}\n";
  return mixture;
}

std::unique_ptr<World> lived(std::unique_ptr<World> world) {
  world->live();
  return world;
}

std::unique_ptr<World> lived(const Mixture& mixture) { return lived(std::make_unique<World>(mixture, quick_folder())); }

enum class Base { clean, lossy, stalled, stopped, erring, killed, resumed };
World& world_of(Base base);

/// In the middle of its second run, whose number of steps of time is that of the clean one.
Mixture killed_mixture() {
  const Story& story = world_of(Base::clean).story();
  const Instant middle = story.streams.at(1).began + 2s;
  const auto before = std::count_if(story.moments.begin(), story.moments.end(),
                                    [&](const Story::Moment& moment) { return moment.at < middle; });
  Mixture mixture = clean_mixture();
  mixture.kill = Kill{Kill::At::step, static_cast<std::uint64_t>(before)};
  return mixture;
}

/// For a moment, within a window of the clean one.
Mixture stalled_mixture() {
  const Evidence clean = evidence_of(world_of(Base::clean));
  return with_fault(
      fmt::format("at_s: {:.4f}, for_s: 0.1, kind: stall", clean.files[0].steps[1].window_begin_s + 0.06));
}

/// For good, within a step of the clean one.
Mixture erring_mixture() {
  const Evidence clean = evidence_of(world_of(Base::clean));
  return with_fault(
      fmt::format("at_s: {:.4f}, kind: status, bits: 0x88000000", clean.files[0].steps[1].window_begin_s));
}

std::unique_ptr<World> lived_again() {
  const auto former = lived(killed_mixture());
  Mixture mixture = clean_mixture();
  mixture.life = 2;
  mixture.answers.clear();
  return lived(std::make_unique<World>(mixture, quick_folder(), *former->left()));
}

std::unique_ptr<World> lived(Base base) {
  switch (base) {
    case Base::clean:
      return lived(clean_mixture());
    case Base::lossy:
      return lived(with_fault("at_s: 0, for_s: 60, kind: loss, p: 0.05, burst: 1"));
    case Base::stalled:
      return lived(stalled_mixture());
    case Base::stopped:
      return lived(with_fault("at_s: 9, kind: taken_over"));
    case Base::erring:
      return lived(erring_mixture());
    case Base::killed:
      return lived(killed_mixture());
    case Base::resumed:
      return lived_again();
  }
  throw std::logic_error("no such base");
}

World& world_of(Base base) {
  static std::map<Base, std::unique_ptr<World>> worlds;
  if (!worlds.contains(base)) {
    auto world = lived(base);
    worlds[base] = std::move(world);
  }
  return *worlds[base];
}

End end_of(Base base) {
  if (base == Base::stopped || base == Base::erring) return End::stopped;
  return base == Base::killed ? End::killed : End::finished;
}

/// Of a folder of its own, which may be spoilt.
Evidence evidence_in(const fs::path& copy, Base base) {
  Evidence evidence = evidence_of(world_of(base));
  fs::copy(evidence.left->path(), copy, fs::copy_options::recursive);
  for (FileOfRun& file : evidence.files) file.path = copy / file.path.lexically_relative(evidence.left->path());
  evidence.left = results::CampaignFolder::open(copy);
  return evidence;
}

struct Sabotage {
  const char* what;
  Base base;
  std::function<void(Evidence&)> spoil;
  const char* told;  ///< in one line of the verdict
};

void expect_each_named(const std::vector<Sabotage>& sabotages) {
  std::set<Base> right;
  for (const Sabotage& sabotage : sabotages) {
    SCOPED_TRACE(sabotage.what);
    const test::TemporaryFolder folder(quick_folder());
    Evidence evidence = evidence_in(folder / "copy", sabotage.base);
    if (right.insert(sabotage.base).second) {
      EXPECT_THAT(judge(evidence).wrong, testing::IsEmpty()) << "before anything is spoilt";
    }
    ASSERT_EQ(name_of(evidence.story.end), std::string(name_of(end_of(sabotage.base))));
    sabotage.spoil(evidence);
    EXPECT_THAT(judge(evidence).wrong, testing::Contains(testing::HasSubstr(sabotage.told)));
  }
}

void write_over(const fs::path& file, const std::string& text) {
  fs::permissions(file, fs::perms::owner_write, fs::perm_options::add);
  std::ofstream(file, std::ios::binary) << text;
}

void flip_a_byte(const fs::path& file, double where) {
  std::string bytes = results::read_text(file);
  bytes[static_cast<std::size_t>(where * static_cast<double>(bytes.size()))] ^= 0x40;
  write_over(file, bytes);
}

void lose_a_quarter(const fs::path& file) {
  std::string bytes = results::read_text(file);
  std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 4), bytes.size() / 4, '\0');
  write_over(file, bytes);
}

void replace_in(const fs::path& file, const std::string& words, const std::string& by) {
  std::string text = results::read_text(file);
  ASSERT_NE(text.find(words), std::string::npos);
  write_over(file, text.replace(text.find(words), words.size(), by));
}

fs::path other_run(const Evidence& evidence, const std::string& words) {
  for (const auto& path : evidence.left->other_runs())
    if (path.filename().string().find(words) != std::string::npos) return path;
  throw std::runtime_error("no " + words);
}

/// Of all steps.
void withdraw(Evidence& evidence, std::uint32_t flags) {
  for (FileOfRun& file : evidence.files)
    for (auto& step : file.steps) step.quality_flags &= ~flags;
}

Sabotage counted_once_more(const char* what, std::uint64_t SampleAccount::*count, const char* told) {
  return {what, Base::clean, [count](Evidence& e) { ++(e.files[0].run.account.*count); }, told};
}

TEST(SoakVerdict, NamesWhatIsWrongInTheAccount) {
  using A = SampleAccount;
  expect_each_named({
      {"a record is left out of the file", Base::clean,
       [](Evidence& e) { e.files[0].run.load_cell.erase(e.files[0].run.load_cell.begin() + 500); },
       "is not the one in truth"},
      {"a record is in the file twice", Base::clean,
       [](Evidence& e) {
         e.files[0].run.load_cell.insert(e.files[0].run.load_cell.begin(), e.files[0].run.load_cell[0]);
       },
       "is not the one in truth"},
      {"a record is said to have come later", Base::clean,
       [](Evidence& e) { e.files[0].run.load_cell[500].arrival_ns += 1; }, "is not the one in truth"},
      {"the last record is left out", Base::clean, [](Evidence& e) { e.files[0].run.load_cell.pop_back(); },
       "records in the file: counted"},
      {"a datagram that is in the file never came", Base::clean,
       [](Evidence& e) { e.story.streams[0].arrivals.erase(e.story.streams[0].arrivals.begin() + 20); },
       "received: counted"},
      counted_once_more("received", &A::received, "received: counted"),
      counted_once_more("lost in the network", &A::lost_network, "lost in the network: counted"),
      counted_once_more("lost in the host", &A::lost_host, "lost in the host: counted"),
      counted_once_more("expected", &A::expected, "sum: counted"),
      counted_once_more("duplicates", &A::duplicates, "duplicates: counted"),
      counted_once_more("late", &A::late, "late: counted"),
      counted_once_more("stalled", &A::stalled, "stalled: counted"),
      counted_once_more("restarts", &A::restarts, "restarts: counted"),
      counted_once_more("reboots", &A::reboots, "reboots: counted"),
      counted_once_more("irregular", &A::irregular, "irregular: counted"),
      counted_once_more("malformed", &A::malformed, "malformed: counted"),
  });
}

TEST(SoakVerdict, NamesWhatIsWrongWithTheMotion) {
  using M = sim::PowerStage::Mode;
  expect_each_named({
      {"the stage is never opened", Base::stopped, [](Evidence& e) { e.story.stages.back().mode = M::drive; },
       "never coasts"},
      {"the motor is braked", Base::stopped, [](Evidence& e) { e.story.stages.back().mode = M::brake; },
       "never coasts"},
      {"the stage is opened late", Base::stopped,
       [](Evidence& e) { e.story.stages.back().at = e.story.last_good_tick + 70ms; }, "50 ms are allowed"},
      {"the module's own time-out is late", Base::killed,
       [](Evidence& e) { e.story.stages.back().at = e.story.ended + 700ms; }, "after the kill, 600 ms are allowed"},
      {"the campaign ends before the motor coasts", Base::clean,
       [](Evidence& e) { e.story.stages.back().at = e.story.ended + 1ms; }, "the motor does not coast"},
      {"driven at a prompt", Base::clean, [](Evidence& e) { e.story.prompts.at(1).mode = M::drive; },
       "at a prompt the motor does not coast"},
      {"turning at a prompt", Base::clean, [](Evidence& e) { e.story.prompts.at(1).speed_rad_s = 20; },
       "at a prompt the propeller turns"},
      {"driven without a record", Base::clean,
       [](Evidence& e) {
         auto& arrivals = e.story.streams[0].arrivals;
         const Instant middle = e.story.stages[1].at + 1s;
         std::erase_if(arrivals, [&](const auto& a) { return a.at > middle && a.at < middle + 300ms; });
       },
       "though no record came"},
  });
}

/// The box has reported it in `records` samples on end, in the middle of the first run.
void report(Evidence& evidence, std::uint32_t status, std::size_t records) {
  auto& samples = evidence.files[0].run.load_cell;
  for (std::size_t i = 0; i < records; ++i) samples.at(samples.size() / 2 + i).status = status;
}

std::size_t patience_of(const Evidence& e) { return static_cast<std::size_t>(e.config.netbox.records_per_datagram); }

TEST(SoakVerdict, NamesARunThatWentOnThoughTheBoxReportedAnError) {
  expect_each_named({
      {"an error is passed over", Base::clean, [](Evidence& e) { report(e, 0x88000000, patience_of(e) + 1); },
       "is complete, though the box reported an error"},
      {"the motor is driven on", Base::erring, [](Evidence& e) { e.story.stages.back().at += 100ms; },
       "after the box reported an error in more samples than a datagram holds"},
  });
}

TEST(SoakVerdict, LetsARunGoOnWhoseBoxReportedLess) {
  const test::TemporaryFolder folder(quick_folder());
  for (const std::uint32_t status : {0x88000000u, 0x80010000u, 0x80020000u, 0x80100000u}) {
    Evidence evidence = evidence_in(folder / fmt::format("{:x}", status), Base::clean);
    report(evidence, status, status == 0x88000000u ? patience_of(evidence) : 200);
    EXPECT_THAT(judge(evidence).wrong, testing::IsEmpty());
  }
}

TEST(SoakVerdict, NamesWhatIsWrongInTheRecord) {
  expect_each_named({
      {"a bit of an accepted run", Base::clean, [](Evidence& e) { flip_a_byte(e.left->complete_runs()[0], 0.5); },
       "SHA-256 does not match the journal"},
      {"an accepted run is gone", Base::clean, [](Evidence& e) { fs::remove(e.left->complete_runs()[0]); },
       "missing, but in the journal"},
      {"an unknown run", Base::clean,
       [](Evidence& e) { fs::copy(e.left->complete_runs()[0], e.left->run(e.campaign.propeller.id, 33, 1)); },
       "not in the journal"},
      {"two unknown runs after a kill", Base::killed,
       [](Evidence& e) {
         for (int i = 1; i <= 2; ++i) fs::copy(e.left->complete_runs()[0], e.left->run(e.campaign.propeller.id, 33, i));
       },
       "not in the journal"},
      {"a word of the journal", Base::clean, [](Evidence& e) { replace_in(e.left->journal(), "mounted", "nounted"); },
       "does not match its checksum"},
      {"the journal's last line", Base::clean,
       [](Evidence& e) {
         const std::string text = results::read_text(e.left->journal());
         write_over(e.left->journal(), text.substr(0, text.rfind('\n', text.size() - 2) + 1));
       },
       "the journal does not end with campaign_finished"},
      {"another reason", Base::stopped, [](Evidence& e) { e.story.reason += "!"; },
       "ends with another reason than the campaign"},
      {"a digit in steps.csv", Base::clean, [](Evidence& e) { replace_in(e.left->steps(), "1", "2"); },
       "steps.csv is not the reduction"},
      {"a run of the plan is missing", Base::clean, [](Evidence& e) { e.campaign.occlusions_deg.push_back(33); },
       "was accepted 0 times"},
      {"something unfinished is left", Base::clean, [](Evidence& e) { e.files[0].path += ".part"; }, "is left over"},
      {"a quarter of an aborted run", Base::stopped, [](Evidence& e) { lose_a_quarter(other_run(e, ".aborted")); },
       ".aborted.h5: "},
      {"a finished run cannot be read", Base::clean,
       [](Evidence& e) {
         e.unreadable.push_back({"runs/a.h5", "torn"});
       },
       "a.h5 cannot be read"},
      {"what was synced cannot be read after a kill", Base::killed,
       [](Evidence& e) {
         e.secured.insert("a.h5.part");
         e.unreadable.push_back({"runs/a.h5.part", "torn"});
       },
       "a.h5.part cannot be read"},
  });
}

TEST(SoakVerdict, NamesWhatAResumedCampaignHasSpoilt) {
  expect_each_named({
      {"a bit of a run that was accepted before", Base::resumed,
       [](Evidence& e) { flip_a_byte(e.left->path() / *e.inherited.accepted.begin(), 0.5); },
       "was accepted and is not what it was"},
      {"a run that was accepted before is gone", Base::resumed,
       [](Evidence& e) { fs::remove(e.left->path() / *e.inherited.accepted.begin()); },
       "was accepted and is not what it was"},
      {"what was left behind is overwritten", Base::resumed,
       [](Evidence& e) { fs::remove(other_run(e, ".interrupted")); }, ".h5.part held is lost"},
      {"the campaign's file is another", Base::resumed,
       [](Evidence& e) { write_over(e.left->campaign_file(), "name: other\n"); }, "campaign.yaml held is lost"},
      {"the journal was begun anew", Base::resumed,
       [](Evidence& e) { replace_in(e.left->journal(), "campaign_started", "campaign_Started"); },
       "the journal does not go on where it ended"},
      {"refused, and yet touched", Base::resumed,
       [](Evidence& e) {
         e.wire = nullptr;
         e.story.end = End::refused;
       },
       "something was touched"},
      {"a changed script is taken for the same", Base::resumed,
       [](Evidence& e) {
         e.mixture.accepts_changes = false;
         e.inherited.faults_sha256 = "another";
       },
       "why?"},
  });
}

Sabotage ended_as(const char* what, End end, const char* reason, const char* told = "why?") {
  return {what, Base::clean,
          [end, reason](Evidence& e) {
            e.story.end = end;
            e.story.reason = reason;
          },
          told};
}

/// Of a clean campaign followed by an absence; `as_seen` is right.
Sabotage after_an_absence(const char* what, const Absence& absence, const Comeback& as_seen, const char* told) {
  return {what, Base::clean,
          [absence, as_seen](Evidence& e) {
            e.mixture.absence = absence;
            e.story.comeback = as_seen;
          },
          told};
}

TEST(SoakVerdict, NamesAStreamThatDoesNotComeBackOrIsFoughtFor) {
  using K = EventKind;
  const Absence reboot{"", 8s, true, true}, loss{"", 8s, true, false}, taken{"", 8s, false, false};
  const auto seen = [](std::vector<K> events, Instant newest, std::uint64_t starts, const char* failure) {
    return Comeback{std::move(events), newest, 12s, starts, failure};
  };
  expect_each_named({
      after_an_absence("nobody notices", reboot, seen({K::reconnected}, 12s, 2, ""), "nobody noticed"),
      after_an_absence("no sample since", reboot, seen({K::silent, K::reconnected}, 7s, 2, ""), "the newest sample"),
      after_an_absence("it counts as failed", reboot, seen({K::silent, K::reconnected}, 12s, 2, "silent"), "as failed"),
      after_an_absence("no event", reboot, seen({K::silent, K::resumed}, 12s, 2, ""), "that the stream came back"),
      after_an_absence("another event", loss, seen({K::silent, K::restarted}, 12s, 1, ""), "the stream came back"),
      after_an_absence("a fight", taken, seen({K::silent, K::taken_over}, 7s, 2, "silent"), "2 starts of a stream"),
      after_an_absence("no reason", taken, seen({K::silent}, 7s, 1, "silent"), "was taken over"),
      after_an_absence("it counts as working", taken, seen({K::silent, K::taken_over}, 7s, 1, ""), "as working"),
  });
}

TEST(SoakVerdict, NamesAWrongVerdictOfTheDrivers) {
  expect_each_named({
      {"5 % more thrust without a flag", Base::clean, [](Evidence& e) { e.files[0].steps[1].thrust_n *= 1.05; },
       "N without a flag, in truth"},
      {"5 % more speed without a flag", Base::clean, [](Evidence& e) { e.files[0].steps[1].speed_rad_s *= 1.05; },
       "rad/s without a flag, in truth"},
      {"no thrust that is a number", Base::clean, [](Evidence& e) { e.files[0].steps[1].thrust_n = std::nan(""); },
       "N without a flag, in truth"},
      {"lost samples without a flag", Base::lossy,
       [](Evidence& e) { withdraw(e, static_cast<std::uint32_t>(QualityFlag::lost_samples)); },
       "records are missing in its window, it does not say so"},
      {"a measurement that stands still without a flag", Base::stalled, [](Evidence& e) { withdraw(e, ~0u); },
       "the box was disturbed in its window, it does not say so"},
      {"a flag without a reason", Base::clean,
       [](Evidence& e) { e.files[0].steps[1].quality_flags |= static_cast<std::uint32_t>(QualityFlag::derated); },
       "is out of reach of every fault, its flags are"},
      {"a step is missing", Base::clean, [](Evidence& e) { e.files[0].steps.pop_back(); }, " has 2 steps"},
      {"the air is another", Base::clean, [](Evidence& e) { e.files[0].run.header.air_density_kg_m3 = 1.1; },
       "air of 1.1 kg/m³"},
      ended_as("nobody knows how it ended", End::unknown, "who knows"),
      ended_as("an innocent supply is blamed", End::stopped, "supply: it answers no more",
               "where no fault of that device was"),
      ended_as("an innocent load cell is blamed", End::refused, "Net Box: no answer",
               "where no fault of that device was"),
      ended_as("nobody is blamed", End::stopped, "something is wrong", "names no device"),
      ended_as("a disk that works refuses", End::disk, "disk full: runs/a.h5"),
      ended_as("nobody has pressed Ctrl-C", End::interrupted, "stopped by request"),
      ended_as("all was mounted", End::not_mounted, "no"),
      ended_as("nobody has killed it", End::killed, ""),
      {"it went on although nobody mounted", Base::clean, [](Evidence& e) { e.mixture.answers_are_good = false; },
       "why?"},
  });
}

TEST(SoakVerdict, BearsOnlyAsManyCleanStepsFlaggedAsChanceExplains) {
  EXPECT_TRUE(is_chance(0, 0));
  EXPECT_TRUE(is_chance(0, 40'000));
  const auto of = [](double share, std::uint64_t steps) {
    return is_chance(static_cast<std::uint64_t>(std::lround(share * static_cast<double>(steps))), steps);
  };
  EXPECT_TRUE(of(kFlaggedByChance, 200));
  EXPECT_TRUE(of(kFlaggedByChance, 40'000));
  EXPECT_FALSE(of(1.5 * kFlaggedByChance, 40'000)) << "seen in ten thousand campaigns";
  EXPECT_FALSE(of(0.05, 200)) << "and a larger one in fifty";
}

}  // namespace kphi::soak::soak_verdict_test
