// What is known of one life of a campaign once it is over: what was true, what is left on disk, and what the driver
// makes of it. A plain value: a test may spoil any of it, to see that the verdict finds it.
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "results/campaign_folder.hpp"
#include "results/records.hpp"
#include "results/step_mean.hpp"
#include "test/soak/soak_world.hpp"

namespace kphi::soak {

struct FileOfRun {
  std::filesystem::path path;
  results::RunRecording run;
  std::vector<results::StepMean> steps;  ///< the driver's reduction; none of a run that was not finished
  bool inherited = false;                ///< it was there before this life

  [[nodiscard]] std::string name() const { return path.filename().string(); }
};

struct Unreadable {
  std::filesystem::path path;
  std::string why;
};

struct Evidence {
  Mixture mixture;
  profiles::Campaign campaign;
  profiles::BenchConfig config;
  Story story;
  const sim::WireTruth* wire = nullptr;  ///< none: the bench could not be made
  Inheritance inherited;
  std::optional<results::CampaignFolder> left;
  std::set<std::string> secured;  ///< names of files that were synced once at least
  std::uint64_t refused = 0;      ///< operations that the disk refused
  std::vector<FileOfRun> files;   ///< all that can be read of the runs
  std::vector<Unreadable> unreadable;

  [[nodiscard]] bool killed() const noexcept { return story.end == End::killed; }
  /// The program could not end its record as it wanted to.
  [[nodiscard]] bool cut_short() const noexcept { return killed() || refused > 0; }
};

/// `world` has lived; it must outlive the evidence.
[[nodiscard]] Evidence evidence_of(World& world);

}  // namespace kphi::soak
