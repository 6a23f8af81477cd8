#include "daq/weigh/weigh.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <vector>

#include "daq/campaign/at_the_stand.hpp"
#include "daq/guard/run_stopped.hpp"
#include "daq/run/run.hpp"
#include "results/reduction/bin_statistics.hpp"

namespace kphi::daq {
namespace {

constexpr Duration kTick = std::chrono::milliseconds(20);
constexpr Duration kSwings = std::chrono::seconds(1);  // after a hand was at it
constexpr double kBinSeconds = 0.05;
constexpr double kRestShare = 0.002, kRest_n = 0.005;  // between the halves of a stretch at rest
constexpr int kStretches = 5;                          // until it must have come to rest
constexpr double kLeastShare = 0.5, kMostShare = 1.5;  // of the mass: more or less is another one, or another axis
constexpr double kLeftShare = 0.1;                     // that is still on

using Axes = std::array<double, 6>;

class Procedure {
 public:
  explicit Procedure(const Weigh& order)
      : order_(order), result_(order.weighing), stand_(order.bench, order.stop_asked), stream_(order.bench) {
    const double range = stream_.scale.range[axis()];
    if (range > 0 && result_.force_n() > range)
      throw ConfigurationError(fmt::format("weigh: {:g} kg weigh {:.1f} N; {} of this cell ends at {:g} N: take less",
                                           result_.mass_kg, result_.force_n(), name(), range));
    position_.repetitions = order.times;
    result_.cell_serial = stream_.scale.serial;
  }

  results::Weighing run() {
    order_.progress.say(stand_.condition());
    measure(false, 0);
    for (int i = 1; i <= order_.times; ++i) {
      measure(true, i);
      measure(false, i);
    }
    result_.weighed_utc = utc_text(order_.bench.clock(), order_.bench.clock().now());
    return std::move(result_);
  }

 private:
  struct Stream {
    explicit Stream(Bench& bench) : cell(bench.load_cell()), scale(cell.start()) {}
    ~Stream() { cell.stop(); }
    LoadCellLink& cell;
    const results::LoadCellScale scale;
  };

  [[nodiscard]] std::size_t axis() const { return static_cast<std::size_t>(result_.axis); }
  [[nodiscard]] char name() const { return "xyz"[result_.axis]; }

  /// One level, asked for and measured until it can be what was asked for.
  void measure(bool loaded, int repetition) {
    position_.repetition = repetition;
    for (;;) {
      ask(loaded);
      order_.bench.hung(result_.axis, loaded ? result_.force_n() : 0);
      const results::Weighing::Level level = at_rest(loaded);
      const std::string doubt = doubt_about(level);
      if (doubt.empty()) {
        result_.levels.push_back(level);
        return;
      }
      if (order_.keys == nullptr) throw DataRejected("weigh: " + doubt);
      order_.progress.say(doubt);
    }
  }

  void ask(bool loaded) {
    if (order_.keys == nullptr) return;
    position_.phase = loaded ? kPutOn : kTakeOff;
    order_.progress.say(
        loaded ? fmt::format("Put {:g} kg on, so that it pulls along {}; then press Enter.", result_.mass_kg, name())
               : "Take everything off; then press Enter.");
    order_.keys->forget([this] { tick(); });
    for (;;) {
      tick();
      const std::optional<Key> key = order_.keys->next();
      if (key == Key::hold) return;
      if (key == Key::stop) throw Interrupted("stopped by a key");
    }
  }

  results::Weighing::Level at_rest(bool loaded) {
    position_.phase = kMeasuring;
    const Clock& clock = order_.bench.clock();
    const Instant from = clock.now() + kSwings;
    while (clock.now() < from) tick();
    for (int i = 0; i < kStretches; ++i)
      if (const auto level = stretch(loaded)) return *level;
    throw DataRejected(
        fmt::format("weigh: the load on {} does not come to rest within {:.0f} s; keep hands and wind off", name(),
                    kStretches * to_seconds(order_.stretch)));
  }

  /// nullopt: the load was not at rest.
  std::optional<results::Weighing::Level> stretch(bool loaded) {
    const Clock& clock = order_.bench.clock();
    const Instant begin = clock.now(), end = begin + order_.stretch;
    bins_.clear();
    while (clock.now() < end) {
      begin_bin_ = clock.now();
      sum_ = {};
      samples_ = 0;
      while (clock.now() < std::min(end, begin_bin_ + from_seconds(kBinSeconds))) tick();
      if (samples_ > 0) bins_.push_back(mean());
    }
    if (bins_.size() < 2 * results::kLeastValues) throw DeviceError("weigh: too few samples came from the load cell");
    results::Weighing::Level level;
    level.loaded = loaded;
    level.seconds = to_seconds(clock.now() - begin);
    level.time_s = to_seconds(begin) + level.seconds / 2;
    for (std::size_t i = 0; i < level.mean.size(); ++i) {
      std::vector<double> values;
      for (const Axes& bin : bins_) values.push_back(bin[i]);
      const auto half = values.size() / 2;
      const std::span<const double> all(values);
      const double moved = results::mean_error(all.subspan(half)).mean - results::mean_error(all.first(half)).mean;
      if (i == axis() && std::abs(moved) > kRestShare * result_.force_n() + kRest_n) return std::nullopt;
      const results::MeanError error = results::mean_error(all);
      level.mean[i] = error.mean;
      level.u[i] = error.u;
    }
    return level;
  }

  [[nodiscard]] std::string doubt_about(const results::Weighing::Level& level) const {
    if (result_.levels.empty()) return {};
    const double load = level.mean[axis()] - result_.levels.front().mean[axis()], force = result_.force_n();
    if (!level.loaded && std::abs(load) > kLeftShare * force)
      return fmt::format("{} still reads {:.3f} N more than at first: take everything off", name(), load);
    if (level.loaded && !(std::abs(load) >= kLeastShare * force && std::abs(load) <= kMostShare * force))
      return fmt::format(
          "{} reads {:.3f} N more than at first, and {:g} kg weigh {:.3f} N: is that mass on, and along {}?", name(),
          load, result_.mass_kg, force, name());
    return {};
  }

  void tick() {
    order_.bench.wait_until(order_.bench.clock().now() + kTick);
    stand_.check();
    order_.while_at_rest();
    if (order_.stop_asked()) throw Interrupted("stopped by request");
    take();
    if (const std::string failure = stream_.cell.failure(); !failure.empty()) throw DeviceError("weigh: " + failure);
    const Instant now = order_.bench.clock().now();
    Observation seen = observe(newest_, now, {.load_cell = std::chrono::seconds(1), .motor = {}}, order_.bench.clock());
    if (!result_.levels.empty()) seen.thrust_n -= result_.levels.front().mean[axis()];
    seen.account = stream_.cell.account();
    order_.progress.tick(position_, seen);
  }

  void take() {
    std::array<LoadCellRecord, 256> records;
    Axes sum{};
    std::size_t taken = 0;
    while (const std::size_t n = stream_.cell.take(records))
      for (std::size_t i = 0; i < n; ++i, ++taken) add(records[i], sum);
    (void)stream_.cell.take_events();
    if (taken == 0) return;
    for (std::size_t i = 0; i < sum.size(); ++i) sum_[i] += sum[i];
    samples_ += taken;
    newest_.thrust_n = sum[axis()] / static_cast<double>(taken);
    newest_.load_cell_ns = order_.bench.clock().now().count();
  }

  void add(const LoadCellRecord& record, Axes& sum) const {
    const results::LoadCellScale& scale = stream_.scale;
    if (record.status & scale.saturation_bits)
      throw DataRejected("weigh: the load is beyond the range of the cell; take it off");
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] += record.counts[i] / (i < 3 ? scale.counts_per_newton : scale.counts_per_newton_metre);
  }

  [[nodiscard]] Axes mean() const {
    Axes mean = sum_;
    for (double& value : mean) value /= static_cast<double>(samples_);
    return mean;
  }

  const Weigh& order_;
  results::Weighing result_;
  StandAtRest stand_;
  Stream stream_;
  Position position_;
  Readings newest_;
  std::vector<Axes> bins_;
  Instant begin_bin_{};
  Axes sum_{};
  std::size_t samples_ = 0;
};

}  // namespace

results::Weighing weigh(const Weigh& order) { return Procedure(order).run(); }

std::string describe_weighing(const Position& position, const Observation& seen, std::size_t) {
  return fmt::format("{:>9}  {}/{}  {} N", position.phase, position.repetition, position.repetitions,
                     seen.load_cell_is_fresh() ? fmt::format("{:8.3f}", seen.thrust_n) : "       ?");
}

}  // namespace kphi::daq
