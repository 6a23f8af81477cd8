// What the guard costs between driver and recorder at the box's true 7000 records per second: CPU time of its thread
// against that of the receiving thread, and of all threads against its work in the recorder's thread, interleaved. Both
// drain every 5 ms, as on a live bench, and the recorder writes a run file. A third thread does nothing every 5 ms:
// what waking up costs on this host, which the guard pays for its promptness, is told apart from what the relay and its
// judging cost. Goals: relay and judging half of what receiving costs; guard and receiving 2 % of a core.
#include <atomic>
#include <thread>

#include "daq/bench/device_records.hpp"
#include "daq/guard/guard.hpp"
#include "daq/run/recorder.hpp"
#include "test/bench/figures.hpp"
#include "test/daq/queue_bench.hpp"
#include "test/drivers/netbox/receivers.hpp"
#include "test/temporary_folder.hpp"

namespace {

using namespace kphi;
using namespace kphi::netbox::test;
using daq::GuardLimit;
using daq::Watched;

constexpr int kPairs = 5;
constexpr double kSeconds = 2;

/// A load cell on a box, and a motor that says nothing.
class CellBench final : public daq::Bench, private daq::LoadCellLink {
 public:
  explicit CellBench(const Ports& ports) : cell_({"127.0.0.1", ports.rdt, ports.http}, clock_) {}
  [[nodiscard]] const Clock& clock() const override { return clock_; }
  [[nodiscard]] daq::MotorLink& motor() override { return motor_; }
  [[nodiscard]] daq::LoadCellLink& load_cell() override { return *this; }
  void wait_until(Instant) override {}
  [[nodiscard]] std::shared_ptr<void> run_periodically(const ThreadRole&, std::function<void()>) override {
    return nullptr;
  }
  [[nodiscard]] results::FileLayer& files() override { return results::disk(); }
  [[nodiscard]] Duration sync_interval() const override { return std::chrono::milliseconds(500); }
  void mounted(const std::string&, double) override {}
  [[nodiscard]] bool switch_off_power() override { return false; }
  void restore_power(const daq::StopAsked&) override {}
  results::LoadCellScale start() override {
    cell_.start();
    return daq::to_scale(cell_.configuration());
  }
  void stop() noexcept override { cell_.stop(); }

 private:
  [[nodiscard]] results::LoadCellScale scale() const override { return daq::to_scale(cell_.configuration()); }
  [[nodiscard]] const netbox::Configuration* box() const override { return &cell_.configuration(); }
  [[nodiscard]] std::vector<Finding> findings() const override { return {}; }
  std::size_t take(std::span<LoadCellRecord> out) override { return cell_.take(out); }
  [[nodiscard]] std::vector<StreamEvent> take_events() override { return {}; }
  std::string page() override { return {}; }
  void set_bias() noexcept override {}
  [[nodiscard]] std::string failure() const override { return {}; }
  [[nodiscard]] SampleAccount account() const override { return cell_.counters().account(); }
  [[nodiscard]] StreamHealth health() const override { return {}; }

  SteadyClock clock_;
  netbox::LoadCell cell_;
  daq::QueueMotor motor_;
};

/// A thread that works every 5 ms and knows what that costs.
class Working {
 public:
  explicit Working(std::function<void()> work)
      : thread_([this, work = std::move(work)] {
          while (!stop_) {
            work();
            cpu_s_ = cpu_seconds();
            std::this_thread::sleep_for(std::chrono::milliseconds(5));  // the period of the real threads
          }
        }) {}
  ~Working() {
    stop_ = true;
    thread_.join();
  }
  [[nodiscard]] double cpu_s() const { return cpu_s_; }

 private:
  std::atomic<bool> stop_{false};
  std::atomic<double> cpu_s_{0};
  std::thread thread_;
};

/// CPU seconds per second of wall time: shares of a core.
struct Shares {
  double receiver = 0, guard = 0, recorder = 0, idle = 0;
  std::uint64_t received = 0, lost = 0;
  [[nodiscard]] double all() const { return receiver + guard + recorder; }
};

/// The whole table; the rows of a motor that says nothing, and of a runner that is none, would trip.
std::vector<GuardLimit> limits() {
  std::vector<GuardLimit> table;
  for (std::size_t i = 0; i < daq::kWatchedCount; ++i) {
    const auto watched = static_cast<Watched>(i);
    if (watched == Watched::motor_age || daq::row_of(watched).source == daq::Source::runner) continue;
    table.push_back({watched, "", 1e9, "", "", false});
  }
  return table;
}

Shares run(const BoxProcess& box, bool guarded) {
  const kphi::test::TemporaryFolder folder;
  CellBench bench(box.ports());
  const std::set<int> before = threads_of_this_process();
  const results::LoadCellScale scale = bench.load_cell().start();
  int receiver = 0;
  for (const int id : threads_of_this_process())
    if (before.count(id) == 0) receiver = id;
  results::RunHeader header;
  header.load_cell = scale;
  results::RunWriter writer(folder.path() / "run.h5", header);
  daq::Guard guard(bench, {}, scale, limits());
  daq::Recorder recorder(bench, guard, writer);
  guard.take_zero({});
  Shares shares;
  {
    const Working idling([] {});
    const Working recording([&] {
      if (!guarded) (void)guard.relay();
      recorder.drain();
    });
    std::optional<Working> guarding;
    if (guarded) guarding.emplace([&] { guard.poll(); });
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // caches and queues fill
    const auto now = [&] {
      return Shares{cpu_seconds(cpu_clock_of(receiver)), guarding ? guarding->cpu_s() : 0, recording.cpu_s(),
                    idling.cpu_s()};
    };
    const Shares begun = now();
    const double wall = cpu_seconds(CLOCK_MONOTONIC);
    std::this_thread::sleep_for(std::chrono::duration<double>(kSeconds));  // what is measured
    const Shares ended = now();
    const double lasted = cpu_seconds(CLOCK_MONOTONIC) - wall;
    shares = {(ended.receiver - begun.receiver) / lasted, (ended.guard - begun.guard) / lasted,
              (ended.recorder - begun.recorder) / lasted, (ended.idle - begun.idle) / lasted};
  }
  const SampleAccount account = bench.load_cell().account();
  shares.received = writer.samples();
  shares.lost = account.lost_network + account.lost_host;
  bench.stop();
  return shares;
}

void compare(const BoxProcess& box, const std::string& mode) {
  std::vector<double> of_receiving, work_of_receiving, of_all, guard, receiver, recorder, idle;
  for (int i = 0; i < kPairs; ++i) {
    const Shares plain = run(box, false), guarded = run(box, true);
    of_receiving.push_back(guarded.guard / guarded.receiver);
    work_of_receiving.push_back((guarded.guard - guarded.idle) / guarded.receiver);
    of_all.push_back(guarded.all() / plain.all());
    guard.push_back(100 * guarded.guard);
    receiver.push_back(100 * guarded.receiver);
    recorder.push_back(100 * guarded.recorder);
    idle.push_back(100 * guarded.idle);
    if (guarded.lost + plain.lost > 0) fmt::print("{}: {} lost\n", mode, guarded.lost + plain.lost);
  }
  fmt::print("{}: receiving {:.2f}, guard {:.2f}, recorder {:.2f}, a thread that does nothing {:.2f} % of a core\n",
             mode, median(receiver), median(guard), median(recorder), median(idle));
  bench::at_most(0.5, median(work_of_receiving), mode + ", 7 kHz: CPU time of relay and judging / receiving thread");
  bench::compared(median(of_receiving), mode + ", 7 kHz: CPU time of guard with its wake-ups / receiving thread");
  bench::compared(median(of_all), mode + ", 7 kHz: CPU time of all threads with guard / without");
  bench::at_most(1, (median(guard) + median(receiver)) / 2,
                 mode + ", 7 kHz: guard and receiving thread / 2 % of a core");
}

}  // namespace

int main() {
  const BoxProcess single({.records_per_datagram = 1}), blocks({});
  compare(blocks, "buffered");
  compare(single, "single-record");
}
