#include "test/soak/soak_world.hpp"

#include <unistd.h>

#include <cmath>
#include <fstream>
#include <utility>

#include "base/error.hpp"
#include "daq/guard/interlock.hpp"
#include "results/journal.hpp"

namespace kphi::soak {
namespace {

constexpr Duration kAfterwards = std::chrono::seconds(1);

std::string bench_text(const Mixture& mixture) {
  return mixture.bench + "simulation: {in_process: true, seed: " + std::to_string(mixture.seed) +
         ", faults: faults.yaml}\n";
}

}  // namespace

/// What a person types.
class Keyboard {
 public:
  Keyboard() {
    if (::pipe(ends_) != 0) throw std::runtime_error("no pipe");
  }
  ~Keyboard() {
    ::close(ends_[0]);
    leave();
  }
  Keyboard(const Keyboard&) = delete;
  Keyboard& operator=(const Keyboard&) = delete;
  void type(const std::string& words) {
    if (::write(ends_[1], words.data(), words.size()) != static_cast<ssize_t>(words.size()))
      throw std::runtime_error("no room in a pipe");
  }
  /// Nothing more comes: end of file.
  void leave() {
    if (ends_[1] >= 0) ::close(std::exchange(ends_[1], -1));
  }
  [[nodiscard]] int descriptor() const noexcept { return ends_[0]; }

 private:
  int ends_[2] = {-1, -1};
};

class Nowhere {
 public:
  Nowhere() : stream(std::fopen("/dev/null", "w")) {}
  ~Nowhere() { std::fclose(stream); }
  Nowhere(const Nowhere&) = delete;
  Nowhere& operator=(const Nowhere&) = delete;
  std::FILE* stream;
};

const char* name_of(End end) noexcept {
  constexpr const char* kNames[] = {"finished",    "stopped",     "refused", "disk refused",
                                    "interrupted", "not mounted", "killed",  "unknown"};
  return kNames[static_cast<std::size_t>(end)];
}

std::filesystem::path quick_folder() {
  return ::access("/dev/shm", W_OK) == 0 ? std::filesystem::path("/dev/shm") : std::filesystem::temp_directory_path();
}

std::map<std::string, std::string> files_below(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      files[entry.path().lexically_relative(folder).string()] = results::read_text(entry.path());
  }
  return files;
}

/// The runner's progress, as far as it tells that all was well.
class World::Watch final : public daq::Progress {
 public:
  explicit Watch(World& world) : world_(world) {}
  void tick(const daq::Position&, const daq::Observation&) override {
    world_.story_.last_good_tick = world_.bench_->clock().now();
  }
  void say(const std::string& line) override { world_.story_.said.push_back(line); }

 private:
  World& world_;
};

/// Types a line of what the mixture says whenever a question was asked, and may be the last to be asked.
class World::Person final : public daq::Operator {
 public:
  Person(World& world, std::function<bool()> stop_asked)
      : world_(world),
        answers_(world.mixture_.answers),
        terminal_(keyboard_.descriptor(), nowhere_.stream),
        asked_(terminal_, nowhere_.stream, std::move(stop_asked)) {
    asked_.log_to([this](const std::string& event, const std::string&, const auto&) {
      if (event == "operator_asked") type_the_next();
    });
  }
  void mount(const profiles::Propeller& propeller, double occlusion_deg, const std::string&) override {
    world_.at_prompt();
    if (world_.mixture_.life > 1 && world_.mixture_.answers_are_good)
      answers_ = std::to_string(std::lround(occlusion_deg)) + "\n";
    (void)asked_.confirm_mounting(propeller, occlusion_deg);
  }

 private:
  void type_the_next() {
    if (answers_.empty()) return keyboard_.leave();
    const std::size_t line = std::min(answers_.find('\n'), answers_.size() - 1) + 1;
    keyboard_.type(answers_.substr(0, line));
    answers_.erase(0, line);
  }

  World& world_;
  std::string answers_;  ///< not typed yet
  Keyboard keyboard_;
  Nowhere nowhere_;
  daq::Terminal terminal_;
  daq::TerminalOperator asked_;
};

World::World(const Mixture& mixture, const std::filesystem::path& quick_folder)
    : mixture_(mixture), folder_(quick_folder), disk_(mixture.disk) {
  std::ofstream(folder_ / "faults.yaml") << mixture.faults;
  campaign_ = profiles::parse_campaign(mixture.campaign, "campaign.yaml");
  config_ = profiles::parse_bench(bench_text(mixture), (folder_ / "bench.yaml").string());
  disk_.watch = [this](std::uint64_t number) { at_operation(number); };
}

World::World(const Mixture& mixture, const std::filesystem::path& quick_folder, const results::CampaignFolder& left)
    : World(mixture, quick_folder) {
  const auto taken = folder_ / "resumed";
  std::filesystem::rename(left.path(), taken);
  written_ = results::CampaignFolder::open(taken);
  look_at_inheritance();
}

World::~World() = default;

void World::look_at_inheritance() {
  inherited_.files = files_below(written_->path());
  if (!std::filesystem::exists(written_->journal())) return;
  inherited_.journal = results::read_text(written_->journal());
  inherited_.journal.resize(inherited_.journal.rfind('\n') + 1);
  for (const auto& entry : results::read_journal(written_->journal()).entries) {
    if (entry.event == results::kRunAccepted) inherited_.accepted.insert(entry.data.at("file").get<std::string>());
    if (entry.event == results::kCampaignStarted || entry.event == results::kCampaignResumed)
      inherited_.faults_sha256 = entry.data.at("faults_sha256").get<std::string>();
  }
}

void World::live() {
  live_campaign();
  if (mixture_.absence)
    story_.comeback = live_through(*mixture_.absence, mixture_.bench, mixture_.seed, folder_.path());
}

void World::live_campaign() {
  try {
    begin();
    campaign_to_its_end();
    story_.end = End::finished;
  } catch (const Killed&) {
    story_.end = End::killed;
  } catch (const daq::NotMounted& e) {
    story_.end = End::not_mounted;
    story_.reason = e.what();
  } catch (const daq::Interrupted& e) {
    story_.end = End::interrupted;
    story_.reason = e.what();
  } catch (const daq::SafetyStop& e) {
    story_.end = End::stopped;
    story_.reason = e.what();
  } catch (const daq::RunStopped& e) {
    const bool refused = e.exit_code() == ExitCode::no_device || e.exit_code() == ExitCode::usage;
    story_.end = refused ? End::refused : End::disk;
    story_.reason = e.what();
  } catch (const RecordError& e) {
    story_.end = End::disk;
    story_.reason = e.what();
  } catch (const DeviceError& e) {
    story_.end = End::refused;
    story_.reason = e.what();
  } catch (const ConfigurationError& e) {
    story_.end = End::refused;
    story_.reason = e.what();
  } catch (const std::exception& e) {
    story_.reason = e.what();
  }
  if (!left_) left_ = written_;
  if (!bench_) return;
  story_.ended = bench_->clock().now();
  bench_->let_watch({});
  bench_->abandon();
  for (const Instant end = story_.ended + kAfterwards; bench_->clock().now() < end; look())
    bench_->outlive(bench_->clock().now() + std::chrono::milliseconds(1));
}

/// As `kphi run` does: what is asked of files comes before any device.
void World::begin() {
  if (written_) {
    resumption_ = daq::inspect(*written_, mixture_.accepts_changes);
    resumption_->cleared_by = "soak";
    (void)daq::require_unchanged(*written_, *resumption_, daq::identity_of(campaign_, config_));
  }
  sim::BenchSettings settings;
  settings.keep = sim::FaultInjector::Keep::samples;
  bench_ = std::make_unique<daq::DeterministicBench>(config_, settings);
  bench_->use_files(disk_);
  daq::BenchWitness witness;
  witness.stepped = [this] { step(); };
  witness.stream_began = [this] { story_.streams.push_back({bench_->clock().now(), {}, {}, newest_stream_, 0}); };
  witness.heard = [this](const sim::Datagram& datagram, bool discarded) {
    if (story_.streams.empty()) return;
    const auto bytes = datagram.payload();
    const bool whole = !bytes.empty() && bytes.size() % 36 == 0 && bytes.size() <= 1440;
    auto& stream = story_.streams.back();
    if (!whole) stream.malformed.push_back(datagram.at);
    if (whole) newest_stream_ = std::max(newest_stream_, datagram.stream);
    if (whole && !discarded && datagram.stream <= stream.former) stream.strays += bytes.size() / 36;
    if (whole && !discarded && datagram.stream > stream.former)
      stream.arrivals.push_back({datagram.boot, datagram.stream, netbox::test::first_rdt(bytes), datagram.at});
  };
  bench_->let_watch(std::move(witness));
}

void World::campaign_to_its_end() {
  if (!written_) written_.emplace(results::CampaignFolder::create(folder_.path(), "u", "soak", disk_));
  const std::function<bool()> stop_asked = [this] {
    return mixture_.interrupt && bench_->clock().now() >= *mixture_.interrupt;
  };
  Person person(*this, stop_asked);
  Watch watch(*this);
  (void)daq::run_campaign(*bench_, campaign_, config_, *written_, person, watch, stop_asked,
                          resumption_ ? &*resumption_ : nullptr);
}

void World::step() {
  look();
  if (killed_) throw Killed{};
  if (lie_is_due_ && !bench_->simulation().mounted().empty()) {
    lie_is_due_ = false;
    bench_->simulation().mount(campaign_.propeller.id, *mixture_.mounted_instead_deg);
  }
  kill_at(Kill::At::step, ++steps_);
  if (mixture_.sleep && !story_.woke && bench_->clock().now() >= mixture_.sleep->at) sleep();
}

void World::sleep() {
  story_.woke = bench_->clock().now();  // no second time
  bench_->sleep(mixture_.sleep->lasts, [this] { look(); });
  story_.woke = bench_->clock().now();
}

void World::look() {
  const sim::Plant& plant = bench_->simulation().plant();
  const Instant now = bench_->clock().now();
  const auto mode = bench_->simulation().motor().stage().mode;
  if (story_.stages.empty() || story_.stages.back().mode != mode) story_.stages.push_back({now, mode});
  story_.moments.push_back({now, std::abs(plant.motor().speed), plant.thrust(), plant.motor().supply_volts});
}

void World::at_operation(std::uint64_t number) {
  if (killed_) throw Killed{};
  kill_at(Kill::At::file_operation, number);
  if (!mixture_.kill || mixture_.kill->at != Kill::At::write || !written_) return;
  if (number == mixture_.kill->number) torn_.before(written_->path());
  if (number == mixture_.kill->number + 1) die();
}

void World::at_prompt() {
  story_.prompts.push_back({bench_->clock().now(), bench_->simulation().motor().stage().mode,
                            std::abs(bench_->simulation().plant().motor().speed)});
  ++prompts_;
  lie_is_due_ = prompts_ == 2 && mixture_.mounted_instead_deg;
  kill_at(Kill::At::prompt, prompts_);
}

void World::kill_at(Kill::At at, std::uint64_t number) {
  if (mixture_.kill && mixture_.kill->at == at && mixture_.kill->number == number) die();
}

void World::die() {
  killed_ = true;
  bench_->abandon();
  keep_what_the_disk_holds();
  throw Killed{};
}

void World::keep_what_the_disk_holds() {
  if (!written_) return;
  const auto copy = folder_ / "left";
  std::filesystem::copy(written_->path(), copy, std::filesystem::copy_options::recursive);
  torn_.tear(written_->path(), copy, mixture_.seed);
  if (std::filesystem::exists(copy / "journal.jsonl") || std::filesystem::exists(copy / "runs"))
    left_ = results::CampaignFolder::open(copy);
}

}  // namespace kphi::soak
