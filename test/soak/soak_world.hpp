// One mixture lived through on the deterministic bench, watched from outside.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "daq/campaign/campaign_run.hpp"
#include "daq/campaign/resume.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "test/drivers/netbox_faults/ideal.hpp"
#include "test/soak/campaign_mixture.hpp"
#include "test/soak/spoilt_disk.hpp"
#include "test/soak/torn_write.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::soak {

/// Thrown where a program dies by kill -9: no handler of the program's knows it.
struct Killed {};

enum class End { finished, stopped, refused, disk, interrupted, not_mounted, killed, unknown };
[[nodiscard]] const char* name_of(End end) noexcept;

/// What was true, in bench time.
struct Story {
  struct StageChange {
    Instant at;
    sim::PowerStage::Mode mode;
  };
  struct Moment {
    Instant at;
    double speed_rad_s;  ///< unsigned
    double thrust_n;     ///< without noise and zero
    double supply_v;     ///< at the module
  };
  struct Prompt {
    Instant at;
    sim::PowerStage::Mode mode;
    double speed_rad_s;  ///< unsigned
  };
  struct Stream {
    Instant began;
    std::vector<netbox::test::Arrival> arrivals;
    std::vector<Instant> malformed;
    std::uint32_t former = 0;  ///< number of the box's newest stream before it
    std::uint64_t strays = 0;  ///< records of such a one that came after all: the session can only discard them
  };
  std::vector<StageChange> stages;
  std::vector<Moment> moments;
  std::vector<Stream> streams;
  std::vector<Prompt> prompts;  ///< somebody is about to reach into the propeller
  std::vector<std::string> said;
  std::optional<Instant> woke;       ///< of the computer's sleep; nullopt: it did not sleep
  std::optional<Comeback> comeback;  ///< of an absent box
  Instant last_good_tick{0};         ///< when the runner looked at everything last and went on
  Instant ended{0};
  End end = End::unknown;
  std::string reason;  ///< of the exception
};

/// Name relative to `folder` → bytes, of all files in it and below.
[[nodiscard]] std::map<std::string, std::string> files_below(const std::filesystem::path& folder);

/// What a campaign's folder held when somebody went on with it.
struct Inheritance {
  std::map<std::string, std::string> files;  ///< as files_below() gives them
  std::set<std::string> accepted;            ///< of these names
  std::string journal;                       ///< its whole lines
  std::string faults_sha256;                 ///< of the script it was begun or last resumed with; empty: none is known
};

class World {
 public:
  /// `quick_folder`: for what the campaign writes.
  World(const Mixture& mixture, const std::filesystem::path& quick_folder);
  /// Goes on with the campaign in `left`, which it takes away from there.
  World(const Mixture& mixture, const std::filesystem::path& quick_folder, const results::CampaignFolder& left);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// The campaign, to whatever end; then the devices by themselves for a second; then the stream of an absent box.
  void live();

  [[nodiscard]] const Mixture& mixture() const noexcept { return mixture_; }
  [[nodiscard]] const Story& story() const noexcept { return story_; }
  [[nodiscard]] const SpoiltDisk& disk() const noexcept { return disk_; }
  [[nodiscard]] const profiles::Campaign& campaign() const noexcept { return campaign_; }
  [[nodiscard]] const profiles::BenchConfig& config() const noexcept { return config_; }
  /// nullptr: it could not be made.
  [[nodiscard]] daq::DeterministicBench* bench() noexcept { return bench_.get(); }
  /// What was there before; empty for a new campaign.
  [[nodiscard]] const Inheritance& inherited() const noexcept { return inherited_; }
  /// What is left of the campaign; after a kill as it was at that moment, whatever destructors did later. Nothing: it
  /// did not come so far.
  [[nodiscard]] const std::optional<results::CampaignFolder>& left() const noexcept { return left_; }

 private:
  class Watch;
  class Person;
  void look_at_inheritance();
  void live_campaign();
  void begin();
  void campaign_to_its_end();
  void step();
  void look();
  void sleep();
  void at_operation(std::uint64_t number);
  void at_prompt();
  void kill_at(Kill::At at, std::uint64_t number);
  void die();
  void keep_what_the_disk_holds();

  const Mixture mixture_;
  test::TemporaryFolder folder_;
  SpoiltDisk disk_;
  profiles::Campaign campaign_;
  profiles::BenchConfig config_;
  std::unique_ptr<daq::DeterministicBench> bench_;
  std::optional<results::CampaignFolder> written_, left_;
  Inheritance inherited_;
  std::optional<daq::Resumption> resumption_;
  TornWrite torn_;
  Story story_;
  std::uint64_t steps_ = 0, prompts_ = 0;
  std::uint32_t newest_stream_ = 0;  ///< of the box, as heard
  bool killed_ = false, lie_is_due_ = false;
};

/// Where files cost least: memory, when the system offers it.
[[nodiscard]] std::filesystem::path quick_folder();

}  // namespace kphi::soak
