#include "test/soak/soak_world.hpp"

#include <unistd.h>

#include <fstream>
#include <utility>

#include "daq/interlock.hpp"
#include "drivers/device_error.hpp"
#include "profiles/configuration_error.hpp"
#include "results/record_error.hpp"

namespace kphi::soak {
namespace {

constexpr Duration kAfterwards = std::chrono::seconds(1);
constexpr double kSafeToTouch = 5.0;  // rad/s

std::string bench_text(const Mixture& mixture, const std::filesystem::path& faults) {
  return mixture.bench + "simulation: {in_process: true, seed: " + std::to_string(mixture.seed) +
         ", faults: " + faults.string() + "}\n";
}

/// What a person has typed already.
class Typed {
 public:
  explicit Typed(const std::string& answers) {
    int ends[2];
    if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
    descriptor = ends[0];
    const ssize_t written = ::write(ends[1], answers.data(), answers.size());
    ::close(ends[1]);
    if (written != static_cast<ssize_t>(answers.size())) throw std::runtime_error("no room in a pipe");
  }
  ~Typed() { ::close(descriptor); }
  Typed(const Typed&) = delete;
  Typed& operator=(const Typed&) = delete;
  int descriptor = -1;
};

class Nowhere {
 public:
  Nowhere() : stream(std::fopen("/dev/null", "w")) {}
  ~Nowhere() { std::fclose(stream); }
  Nowhere(const Nowhere&) = delete;
  Nowhere& operator=(const Nowhere&) = delete;
  std::FILE* stream;
};

}  // namespace

const char* name_of(End end) noexcept {
  constexpr const char* kNames[] = {"finished",    "stopped",     "refused", "disk refused",
                                    "interrupted", "not mounted", "killed",  "unknown"};
  return kNames[static_cast<std::size_t>(end)];
}

std::filesystem::path quick_folder() {
  return ::access("/dev/shm", W_OK) == 0 ? std::filesystem::path("/dev/shm") : std::filesystem::temp_directory_path();
}

/// The runner's progress, as far as it tells that all was well.
class World::Watch final : public daq::Progress {
 public:
  explicit Watch(World& world) : world_(world) {}
  void tick(const daq::Position&, const daq::Observation&) override {
    world_.story_.last_good_tick = world_.bench_->clock().now();
  }
  void step_done(const daq::Position&, const daq::Observation&) override {}
  void say(const std::string& line) override { world_.story_.said.push_back(line); }

 private:
  World& world_;
};

/// Types what the mixture says, and may be the last to be asked.
class World::Person final : public daq::Operator {
 public:
  Person(World& world, std::function<bool()> stop_asked)
      : world_(world),
        typed_(world.mixture_.answers),
        asked_(typed_.descriptor, nowhere_.stream, std::move(stop_asked)) {}
  void mount(const profiles::Propeller& propeller, double occlusion_deg) override {
    world_.at_prompt();
    (void)asked_.confirm_mounting(propeller, occlusion_deg);
  }

 private:
  World& world_;
  Typed typed_;
  Nowhere nowhere_;
  daq::TerminalOperator asked_;
};

World::World(const Mixture& mixture, const std::filesystem::path& quick_folder)
    : mixture_(mixture), folder_(quick_folder), disk_(mixture.disk) {
  std::ofstream(folder_ / "faults.yaml") << mixture.faults;
  campaign_ = profiles::parse_campaign(mixture.campaign, "campaign.yaml");
  place_ = profiles::parse_bench(bench_text(mixture, folder_ / "faults.yaml"), "bench.yaml");
  disk_.watch = [this](std::uint64_t number) { at_operation(number); };
}

World::~World() = default;

void World::live() {
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
  } catch (const results::RecordError& e) {
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

void World::begin() {
  sim::BenchSettings settings;
  settings.keep = sim::FaultyWire::Keep::samples;
  bench_ = std::make_unique<daq::DeterministicBench>(place_, settings);
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
  written_.emplace(results::CampaignFolder::create(folder_.path(), "u", "soak", disk_));
  const std::function<bool()> stop_asked = [this] {
    return mixture_.interrupt && bench_->clock().now() >= *mixture_.interrupt;
  };
  Person person(*this, stop_asked);
  Watch watch(*this);
  (void)daq::run_campaign(*bench_, campaign_, place_, *written_, person, watch, stop_asked);
}

void World::step() {
  look();
  if (killed_) throw Killed{};
  if (lie_is_due_ && !bench_->simulation().mounted().empty()) {
    lie_is_due_ = false;
    bench_->simulation().mount(campaign_.propeller.id, *mixture_.mounted_instead_deg);
  }
  kill_at(Kill::At::step, ++steps_);
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
}

/// Somebody is about to reach into the propeller.
void World::at_prompt() {
  const sim::SimulatedBench& bench = bench_->simulation();
  if (bench_->simulation().motor().stage().mode != sim::PowerStage::Mode::coast)
    story_.danger.push_back("at a prompt the motor does not coast");
  if (std::abs(bench.plant().motor().speed) > kSafeToTouch) story_.danger.push_back("at a prompt the propeller turns");
  ++prompts_;
  lie_is_due_ = prompts_ == 2 && mixture_.mounted_instead_deg;
  kill_at(Kill::At::prompt, prompts_);
}

void World::kill_at(Kill::At at, std::uint64_t number) {
  if (!mixture_.kill || mixture_.kill->at != at || mixture_.kill->number != number) return;
  killed_ = true;
  bench_->abandon();
  keep_what_the_disk_holds();
  throw Killed{};
}

void World::keep_what_the_disk_holds() {
  if (!written_) return;
  const auto copy = folder_ / "left";
  std::filesystem::copy(written_->path(), copy, std::filesystem::copy_options::recursive);
  if (std::filesystem::exists(copy / "journal.jsonl")) left_ = results::CampaignFolder::open(copy);
}

}  // namespace kphi::soak
