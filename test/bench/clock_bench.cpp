// How well the box's clock is known, against the times that the simulator took its samples at: over the model of
// delays, every host and mode; then over real sockets for 45 s, the simulator's clock 60 ppm fast and wandering, two
// busy loops beside. Goal: 5 us rms after 30 s, plus a constant.
#include <filesystem>
#include <string>
#include <thread>
#include <unordered_map>

#include "drivers/netbox/receive/load_cell.hpp"
#include "drivers/sim/bench_server.hpp"
#include "test/bench/figures.hpp"
#include "test/drivers/netbox/busy_loops.hpp"
#include "test/drivers/netbox/delay_channel.hpp"

namespace {

using namespace kphi;
using namespace kphi::netbox;
using namespace kphi::netbox::test;

void state(const std::string& what, const Quality& quality, double skew_ppm) {
  fmt::print("{}: rms {:.1f} mean {:+.1f} largest {:.1f} us, skew {:+.1f} ppm\n", what, quality.rms_us, quality.mean_us,
             quality.largest_us, skew_ppm);
  bench::at_most(1, quality.spread_us() / 5, what + ": rms less the constant / 5 us");
}

void over_the_model() {
  for (const ChannelCase& c : channel_cases()) {
    Channel channel(c.manner, 1);
    ClockEstimate estimate(kRate);
    const Quality quality = quality_of(channel, estimate, 240);
    state(fmt::format("model: {}, wander {:+.1f} ppm", c.name, c.manner.wander_ppm), quality, estimate.skew_ppm());
  }
}

struct Told {
  std::uint32_t ft;
  Instant host;
};

/// What the estimate said of each datagram's last record when it had come.
std::vector<Told> listen(LoadCell& cell, ClockEstimate& estimate, std::chrono::seconds duration) {
  std::vector<Told> told;
  std::vector<LoadCellRecord> records(4096);
  LoadCellRecord last;
  const auto end = std::chrono::steady_clock::now() + duration;
  while (std::chrono::steady_clock::now() < end) {
    if (!cell.wait(std::chrono::milliseconds(100))) continue;
    const std::size_t count = cell.take(records);
    for (std::size_t i = 0; i < count; ++i) {
      if (last.arrival_ns > 0 && records[i].arrival_ns != last.arrival_ns) {
        const Duration late = estimate.add(last.ft_sequence, last.arrival());
        told.push_back({last.ft_sequence, last.arrival() - late});
      }
      last = records[i];
    }
  }
  return told;
}

Quality against_truth(const std::vector<Told>& told, const sim::WireTruth& truth) {
  std::unordered_map<std::uint32_t, Instant> sampled;
  for (const sim::SentDatagram& sent : truth.log)
    sampled[sent.last_ft] = truth.sampled[sent.first_sample + sent.records - 1];
  Errors errors;
  const Duration constant = told.back().host - sampled.at(told.back().ft);
  const Instant first = told.front().host;
  for (const Told& t : told)
    if (t.host - first > std::chrono::seconds(30)) errors.add(1e6 * to_seconds(t.host - sampled.at(t.ft) - constant));
  return errors.quality();
}

void over_real_sockets(int records_per_datagram, int busy_loops) {
  const BusyLoops busy(busy_loops);
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / fmt::format("kphi-clock-{}", getpid());
  std::filesystem::create_directory(folder);
  sim::ServerSettings settings;
  settings.control = folder / "control";
  settings.bench.netbox.rate_hz = 7000;
  settings.bench.netbox.records_per_datagram = records_per_datagram;
  settings.bench.keep = sim::FaultInjector::Keep::samples;
  sim::Fault skew;
  skew.kind = sim::FaultKind::clock_skew;
  skew.lasts = kNever;
  skew.ppm = 60;
  skew.wander_ppm = 0.5;
  skew.period = std::chrono::seconds(600);
  settings.bench.faults = {skew};
  sim::Server server(settings);
  std::thread box([&] { server.run(); });
  const SteadyClock clock;
  ClockEstimate estimate(7000);
  std::vector<Told> told;
  {
    LoadCell cell({"127.0.0.1", server.addresses().rdt_port, server.addresses().http_port}, clock);
    cell.start();
    told = listen(cell, estimate, std::chrono::seconds(45));
  }
  server.request_stop();
  box.join();
  state(fmt::format("sockets: {}, {} busy loops", records_per_datagram > 1 ? "buffered" : "single-record", busy_loops),
        against_truth(told, server.truth()), estimate.skew_ppm());
  std::filesystem::remove_all(folder);
}

}  // namespace

int main() {
  over_the_model();
  over_real_sockets(40, 2);
  over_real_sockets(1, 2);
}
