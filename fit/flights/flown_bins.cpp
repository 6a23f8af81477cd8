#include "fit/flights/flown_bins.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

#include "base/error.hpp"
#include "base/statistics.hpp"
#include "compensation/flight/simulated_vehicle.hpp"
#include "compensation/occlusion.hpp"

namespace kphi::fit {
namespace {

using compensation::Rotors;

constexpr double kNotLogged = std::numeric_limits<double>::quiet_NaN();
constexpr double kEarth = 9.80665;
constexpr double kLeastSeconds = 20;
constexpr double kOpen = 5;          // degrees of φ, below which a rotor counts as open
constexpr double kGapOfShapes = 3;   // degrees of φ
constexpr double kLeastShape = 3;    // s in one shape
constexpr double kPieceOfShape = 6;  // s

bool known(const FlightChannel& channel) { return channel.time_s.size() > 1; }

double spacing(const FlightChannel& channel) {
  return (channel.time_s.back() - channel.time_s.front()) / static_cast<double>(channel.time_s.size() - 1);
}

/// Reads a channel forward in time.
class Reader {
 public:
  explicit Reader(const FlightChannel& channel) : channel_(&channel) {}

  /// Straight between the samples about `time`; NaN where they are further apart than `gap`, or on one side only.
  double at(double time, double gap) {
    const auto& [times, values] = *channel_;
    while (next_ < times.size() && times[next_] <= time) ++next_;
    while (next_ > 0 && times[next_ - 1] > time) --next_;
    if (next_ == 0 || next_ == times.size() || times[next_] - times[next_ - 1] > gap) return kNotLogged;
    const double wide = times[next_] - times[next_ - 1];
    const double share = wide > 0 ? (time - times[next_ - 1]) / wide : 0;
    return values[next_ - 1] + share * (values[next_] - values[next_ - 1]);
  }
  /// Mean of the samples in [from, to); where there are none, as at() its middle.
  double mean(double from, double to, double gap) {
    const auto& [times, values] = *channel_;
    const auto begin = std::ranges::lower_bound(times, from) - times.begin();
    double sum = 0, count = 0;
    for (auto i = static_cast<std::size_t>(begin); i < times.size() && times[i] < to; ++i) sum += values[i], ++count;
    return count > 0 ? sum / count : at((from + to) / 2, gap);
  }

 private:
  const FlightChannel* channel_;
  std::size_t next_ = 0;
};

double mean_of(const FlightChannel& channel) { return mean(channel.values); }

void require_channels(const FlightLog& log, const LoggedVehicle& vehicle, std::size_t rotors) {
  for (const auto& axis : log.specific_force)
    if (!known(axis)) throw FitError("the log has no acceleration along all three axes; log it, or name its channels");
  const auto missing = [&](const std::vector<FlightChannel>& channels) {
    return channels.size() < rotors || !std::all_of(channels.begin(), channels.begin() + rotors, known);
  };
  if (missing(log.rotor_speed) && missing(log.command))
    throw FitError(
        fmt::format("the log has neither speed nor command of all {} rotors of {} (speeds of {}, commands of "
                    "{}); log them, or name its channels",
                    rotors, vehicle.name, log.rotor_speed.size(), log.command.size()));
  if (!vehicle.arms && !vehicle.hubs && missing(log.arm_angle))
    throw FitError(
        fmt::format("the log does not hold the angles of all {} arms of {}; name their channels, or the "
                    "shape it flew in (--shape)",
                    rotors, vehicle.name));
}

/// By what the accelerometer felt while the rotors turned.
void require_frame(double felt) {
  if (felt < -0.5 * kEarth)
    throw FitError(
        fmt::format("in flight the acceleration along z is {:.2f} m/s^2: z points down in this log, and kphi "
                    "wants it up (x forward, y left); turn the axes in its layout",
                    felt));
  if (std::abs(felt) > 0.8 && std::abs(felt) < 1.25)
    throw FitError(
        fmt::format("in flight the acceleration along z is {:.3f}: that is g, not m/s^2; say so in its layout", felt));
  if (felt < 0.85 * kEarth || felt > 1.2 * kEarth)
    throw FitError(
        fmt::format("in flight the acceleration along z is {:.2f} m/s^2 on average, where a vehicle that stays "
                    "up feels {:.2f}: look at axis, unit and clipping",
                    felt, kEarth));
}

/// Samples that stand at one and the same extreme: the accelerometer had no more range.
double clipped_share(const FlightChannel& channel) {
  const auto [least, most] = std::ranges::minmax(channel.values);
  const auto at = [&](double value) { return std::ranges::count(channel.values, value); };
  const auto clipped = std::max(at(least), at(most));
  return clipped > 3 ? static_cast<double>(clipped) / static_cast<double>(channel.values.size()) : 0;
}

class Cutter {
 public:
  Cutter(const FlightLog& log, const LoggedVehicle& vehicle)
      : log_(log), vehicle_(vehicle), rotors_(compensation::rotors_of(vehicle.airframe)) {
    if (vehicle.hubs) rotors_ = vehicle.hubs->size();
    require_channels(log, vehicle, rotors_);
    flown_.rotors = rotors_;
    for (std::size_t i = 0; i < rotors_; ++i) scene_.x.add(Radians(0));
    scene_.airframe = vehicle.airframe;
    scene_.build = vehicle.build;
    scene_.o = scene_.x;
  }

  FlownBins cut() {
    sample_drive();
    make_bins();
    judge();
    return std::move(flown_);
  }

 private:
  void sample_drive() {
    RotorDrive& drive = flown_.drive;
    drive.commands = log_.rotor_speed.size() < rotors_ ||
                     !std::all_of(log_.rotor_speed.begin(), log_.rotor_speed.begin() + rotors_, known);
    const auto& channels = drive.commands ? log_.command : log_.rotor_speed;
    double apart = 0;
    begin_ = log_.specific_force[2].time_s.front();
    end_ = log_.specific_force[2].time_s.back();
    for (std::size_t i = 0; i < rotors_; ++i) {
      begin_ = std::max(begin_, channels[i].time_s.front());
      end_ = std::min(end_, channels[i].time_s.back());
      apart = std::max(apart, spacing(channels[i]));
    }
    apart = std::max(apart, spacing(log_.specific_force[2]));
    // A sample stands for the time about it: bins begin between two of the accelerometer.
    const double first = log_.specific_force[2].time_s.front(), every = spacing(log_.specific_force[2]);
    begin_ = first + every * (std::ceil((begin_ - first) / every - 1e-6) + 0.5);
    // A bin holds two samples of the slowest channel.
    flown_.width_s = std::max(0.05, 2 * apart);
    if (flown_.width_s > 1)
      throw FitError(
          fmt::format("samples of acceleration and rotors are {:.2g} s apart; log at 10 Hz or faster", apart));
    drive.step_s = flown_.width_s / static_cast<double>(flown_.samples);
    if (!(end_ - begin_ > kLeastSeconds))
      throw FitError(
          fmt::format("acceleration and rotors were logged together for {:.1f} s; a fit needs {:g} s of flight",
                      std::max(0.0, end_ - begin_), kLeastSeconds));
    const auto count = static_cast<std::size_t>((end_ - begin_) / drive.step_s);
    drive.values.assign(count, Rotors<double>(rotors_));
    const double gap = std::max(0.25, 6 * apart);
    for (std::size_t i = 0; i < rotors_; ++i) {
      Reader reader(channels[i]);
      for (std::size_t n = 0; n < count; ++n) drive.values[n][i] = reader.at(time_of(n), gap);
    }
    if (!known(log_.voltage)) return;
    Reader reader(log_.voltage);
    const double middle = mean_of(log_.voltage);
    if (!(middle > 0)) return;
    double last = 1;
    for (std::size_t n = 0; n < count; ++n) {
      const double volts = reader.at(time_of(n), 10) / middle;
      drive.volts.push_back(last = std::isfinite(volts) ? volts : last);
    }
  }

  [[nodiscard]] double time_of(std::size_t sample) const {
    return begin_ + (static_cast<double>(sample) + 0.5) * flown_.drive.step_s;
  }

  /// Σ of the squares of a sample: what the collective goes with, also by commands.
  [[nodiscard]] double collective(std::size_t first) const {
    double sum = 0;
    for (std::size_t n = first; n < first + flown_.samples; ++n)
      for (const double value : flown_.drive.values[n]) sum += value * value;
    return sum / static_cast<double>(flown_.samples);
  }

  void place_arms(const Rotors<Radians>& arms, FlownBin& bin) {
    bin.phi = Rotors<double>(rotors_);
    Rotors<compensation::HubPosition> hubs(rotors_);
    for (std::size_t i = 0; i < rotors_; ++i) {
      const auto beside =
          vehicle_.hubs ? (*vehicle_.hubs)[i] : compensation::hub_beside_body(vehicle_.airframe, i, arms[i]);
      bin.phi[i] = compensation::occlusion_beside_body(vehicle_.airframe, i, beside).value();
      hubs[i] = vehicle_.hubs ? beside : compensation::hub_in_body(vehicle_.airframe, i, arms[i]);
    }
    if (!vehicle_.build_known || vehicle_.hubs) return;
    const auto mass = flight::mass_properties(scene_, arms);
    for (auto& lever : bin.levers) lever = Rotors<double>(rotors_);
    for (std::size_t i = 0; i < rotors_; ++i) {
      bin.levers[0][i] = hubs[i].y.value() - mass.cog.y();
      bin.levers[1][i] = mass.cog.x() - hubs[i].x.value();
    }
    bin.inertia = {mass.inertia(0, 0), mass.inertia(1, 1)};
  }

  void make_bins() {
    const double width = flown_.width_s, gap = std::max(0.1, 2 * width);
    std::vector<Reader> force, arms;
    for (const auto& axis : log_.specific_force) force.emplace_back(axis);
    for (const auto& arm : log_.arm_angle) arms.emplace_back(arm);
    Reader height(log_.height), climb(log_.climb), yaw(log_.angular_rate[2]);
    std::array rates{Reader(log_.angular_rate[0]), Reader(log_.angular_rate[1])};
    std::array turns{Reader(log_.angular_acceleration[0]), Reader(log_.angular_acceleration[1])};
    const bool rates_known = known(log_.angular_rate[0]) && known(log_.angular_rate[1]);
    const bool turns_known = known(log_.angular_acceleration[0]) && known(log_.angular_acceleration[1]);
    flown_.height_logged = known(log_.height);
    flown_.climb_logged = known(log_.climb);

    const std::size_t count = flown_.drive.values.size() / flown_.samples;
    std::vector<double> all;
    for (std::size_t b = 0; b < count; ++b)
      if (const double sum = collective(b * flown_.samples); std::isfinite(sum)) all.push_back(sum);
    if (all.empty())
      throw FitError("speeds or commands of the rotors have gaps throughout; no piece of flight is left");
    const double usual = median(all);
    if (!(usual > 0)) throw FitError("the rotors stand still for most of the log; nothing flew");
    // A log that begins in the air does not show where the ground is: its height is taken to be over ground.
    std::vector<double> lying;
    for (std::size_t b = 0; b < count && flown_.height_logged; ++b) {
      const double at = height.at(begin_ + (static_cast<double>(b) + 0.5) * width, 1);
      if (collective(b * flown_.samples) < 0.3 * usual && std::isfinite(at)) lying.push_back(at);
    }
    const double ground = lying.empty() ? 0 : median(lying);

    std::vector<FlownBin> bins(count);
    std::vector<std::array<double, 2>> across(count);
    std::vector<char> usable(count, 1), flies(count, 0);
    for (std::size_t b = 0; b < count; ++b) {
      const double from = begin_ + static_cast<double>(b) * width, to = from + width;
      FlownBin& bin = bins[b];
      bin.time_s = from + width / 2;
      const double sum = collective(b * flown_.samples);
      std::array<double, 3> felt{};
      for (std::size_t axis = 0; axis < 3; ++axis) felt[axis] = force[axis].mean(from, to, gap);
      bin.force = felt[2];
      across[b] = {felt[0], felt[1]};
      flies[b] = sum > 0.3 * usual ? 1 : 0;
      const auto leave_out = [&](std::size_t LeftOutBins::*why) {
        if (usable[b]) ++(flown_.left_out.*why);
        usable[b] = 0;
      };
      if (std::isfinite(sum) && !flies[b]) leave_out(&LeftOutBins::on_ground);
      Rotors<Radians> now(rotors_), then(rotors_);
      bool turning = false;
      for (std::size_t i = 0; i < rotors_; ++i) {
        now[i] = vehicle_.hubs   ? Radians(0)
                 : vehicle_.arms ? (*vehicle_.arms)[i]
                                 : Radians(arms[i].at(bin.time_s, 0.5));
        if (vehicle_.hubs || vehicle_.arms) continue;
        then[i] = Radians(arms[i].at(bin.time_s + 0.25, 0.5));
        const double before = arms[i].at(bin.time_s - 0.25, 0.5);
        turning = turning || std::abs(then[i].value() - before) > 0.05;
      }
      const bool arms_known = std::ranges::all_of(now, [](Radians arm) { return std::isfinite(arm.value()); });
      if (!std::isfinite(sum + felt[0] + felt[1] + felt[2]) || !arms_known) {
        leave_out(&LeftOutBins::unknown);
        continue;
      }
      place_arms(now, bin);
      if (turning) leave_out(&LeftOutBins::arms_turning);
      const double radius = vehicle_.airframe.propeller_radius.value();
      if (flown_.height_logged && !(height.at(bin.time_s, 1) - ground > 2 * radius))
        leave_out(&LeftOutBins::near_ground);
      bin.climb = flown_.climb_logged ? climb.at(bin.time_s, 1) : 0;
      if (!std::isfinite(bin.climb)) leave_out(&LeftOutBins::unknown);
      if (bin.climb < -1.5) leave_out(&LeftOutBins::sinking);
      const bool free = std::ranges::all_of(bin.phi, [](double phi) { return phi == 0; });
      bin.turns = free && (rates_known || turns_known) && bin.inertia[0] > 0 && width <= 0.11;
      for (std::size_t axis = 0; axis < 2 && bin.turns; ++axis) {
        const double edge = width / 4;
        bin.turning[axis] =
            rates_known
                ? (rates[axis].mean(to - edge, to + edge, gap) - rates[axis].mean(from - edge, from + edge, gap)) /
                      width
                : turns[axis].mean(from, to, gap);
        bin.turns = bin.turns && std::isfinite(bin.turning[axis]);
      }
      if (bin.turns && rates_known && known(log_.angular_rate[2])) {
        // A rotating body also accelerates by −ω × J ω, without any moment from the rotors.
        const double p = rates[0].mean(from, to, gap), q = rates[1].mean(from, to, gap);
        const double r = yaw.mean(from, to, gap), z = bin.inertia[0] + bin.inertia[1];  // flat, nearly
        bin.turning[0] += q * r * (z - bin.inertia[1]) / bin.inertia[0];
        bin.turning[1] -= p * r * (z - bin.inertia[0]) / bin.inertia[1];
        bin.turns = std::isfinite(bin.turning[0] + bin.turning[1]);
      }
    }
    take_forward(across, bins);
    leave_out_ends(bins, usable, flies);
    if (!flown_.climb_logged) integrate_climb(bins, usable);
    for (std::size_t b = 0; b < count; ++b) {
      if (!usable[b]) continue;
      flown_.bins.push_back(bins[b]);
      flown_.first.push_back(b * flown_.samples);
    }
  }

  /// Vibration is left out: what the air does across lasts longer.
  void take_forward(const std::vector<std::array<double, 2>>& across, std::vector<FlownBin>& bins) const {
    const auto wide = static_cast<std::ptrdiff_t>(0.5 / flown_.width_s),
               size = static_cast<std::ptrdiff_t>(bins.size());
    for (std::ptrdiff_t b = 0; b < size; ++b) {
      std::array<double, 2> sum{};
      double count = 0;
      for (std::ptrdiff_t at = std::max<std::ptrdiff_t>(0, b - wide); at <= std::min(size - 1, b + wide); ++at) {
        const auto& [x, y] = across[static_cast<std::size_t>(at)];
        if (std::isfinite(x + y)) sum[0] += x, sum[1] += y, ++count;
      }
      bins[static_cast<std::size_t>(b)].forward = (square(sum[0]) + square(sum[1])) / square(std::max(1.0, count));
    }
  }

  static double upper_quantile(std::vector<double> values, double share) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
  }

  /// Without a height nobody knows where the ground is: the first and last seconds in the air are left out.
  void leave_out_ends(const std::vector<FlownBin>& bins, std::vector<char>& usable, const std::vector<char>& flies) {
    if (flown_.height_logged) return;
    const auto first = std::ranges::find(flies, 1) - flies.begin();
    const auto last =
        static_cast<std::ptrdiff_t>(flies.size()) - 1 - (std::find(flies.rbegin(), flies.rend(), 1) - flies.rbegin());
    const auto ends = static_cast<std::ptrdiff_t>(4 / flown_.width_s);
    for (std::ptrdiff_t b = 0; b < static_cast<std::ptrdiff_t>(bins.size()); ++b) {
      if (b > first + ends && b < last - ends) continue;
      if (usable[static_cast<std::size_t>(b)]) ++flown_.left_out.near_ground;
      usable[static_cast<std::size_t>(b)] = 0;
    }
    flown_.remarks.push_back(
        "no height in the log: 4 s after take-off and before landing left out for the ground effect");
  }

  /// Without a climb rate: the specific force beyond its slow mean, integrated with a memory of 2 s.
  void integrate_climb(std::vector<FlownBin>& bins, const std::vector<char>& usable) {
    const double keep = std::exp(-flown_.width_s / 2), slow = std::exp(-flown_.width_s / 20);
    double middle = kEarth, climb = 0;
    for (std::size_t b = 0; b < bins.size(); ++b) {
      if (usable[b]) {
        middle = slow * middle + (1 - slow) * bins[b].force;
        climb = keep * climb + flown_.width_s * (bins[b].force - middle);
      } else {
        climb *= keep;
      }
      bins[b].climb = climb;
    }
    flown_.remarks.push_back("no climb rate in the log: integrated from the acceleration, with a memory of 2 s");
  }

  void judge() {
    const auto& bins = flown_.bins;
    Excitation& excitation = flown_.excitation;
    excitation.seconds = static_cast<double>(bins.size()) * flown_.width_s;
    if (!(excitation.seconds >= kLeastSeconds)) {
      const LeftOutBins& out = flown_.left_out;
      const auto s = [&](std::size_t n) { return static_cast<double>(n) * flown_.width_s; };
      throw FitError(
          fmt::format("{:.1f} s of flight can be used, a fit needs {:g} s; left out: {:.0f} s on the ground, "
                      "{:.0f} s near it, {:.0f} s with moving arms, {:.0f} s without all channels, {:.0f} s "
                      "sinking fast",
                      excitation.seconds, kLeastSeconds, s(out.on_ground), s(out.near_ground), s(out.arms_turning),
                      s(out.unknown), s(out.sinking)));
    }
    std::vector<double> forces;
    double differences = 0;
    for (std::size_t b = 0; b < bins.size(); ++b) {
      forces.push_back(bins[b].force);
      const auto& values = flown_.drive.values[flown_.first[b] + flown_.samples / 2];
      const double middle = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(rotors_);
      for (const double value : values) differences += square(value / middle - 1);
    }
    require_frame(mean(forces));
    const double clipped = clipped_share(log_.specific_force[2]);
    if (clipped > 0.01)
      throw FitError(
          fmt::format("{:.1f} % of the acceleration along z stand at one extreme: the accelerometer was at the "
                      "end of its range; choose a larger one",
                      100 * clipped));
    if (clipped > 0)
      flown_.remarks.push_back(fmt::format("{:.2g} % of the acceleration along z stand at one extreme", 100 * clipped));
    excitation.differences = std::sqrt(differences / static_cast<double>(bins.size() * rotors_));
    excitation.collective = collective_range(forces);
    take_folds();
    if (known(log_.density)) flown_.density = mean_of(log_.density);
    if (flown_.drive.commands) {
      if (flown_.drive.volts.empty())
        flown_.remarks.push_back("no battery voltage in the log: how far it sank is in ±");
    }
  }

  /// Range of the means over half a second, so that vibration does not count as excitation.
  [[nodiscard]] double collective_range(const std::vector<double>& forces) const {
    const auto wide = static_cast<std::size_t>(std::max(1.0, 0.5 / flown_.width_s));
    std::vector<double> means;
    for (std::size_t b = 0; b + wide <= forces.size(); b += wide)
      means.push_back(mean(std::span(forces).subspan(b, wide)));
    return (upper_quantile(means, 0.95) - upper_quantile(means, 0.05)) / 2 / median(means);
  }

  void take_folds() {
    Excitation& excitation = flown_.excitation;
    std::vector<double> widest;
    for (const FlownBin& bin : flown_.bins) widest.push_back(*std::ranges::max_element(bin.phi));
    const auto seconds = static_cast<std::size_t>(1 / flown_.width_s);
    std::vector<double> sorted = widest;
    std::ranges::sort(sorted, std::greater());
    const double phi = sorted[std::min(seconds, sorted.size() - 1)];
    excitation.widest_deg = phi * 180 / kPi;
    if (!(phi > 0)) return;
    bool folded = false;
    for (const double one : widest) {
      const bool is = one > phi / 2;
      excitation.seconds_folded += is ? flown_.width_s : 0;
      excitation.folds += is != folded ? 1 : 0;
      folded = is;
    }
    take_knots();
  }

  /// Bins by their widest φ, degrees.
  using ByPhi = std::vector<std::pair<double, const FlownBin*>>;

  /// Long and often enough to tell a k, also where a piece of the flight is left out.
  [[nodiscard]] bool enough(ByPhi::const_iterator from, ByPhi::const_iterator to) const {
    std::set<int> pieces;
    for (auto one = from; one != to; ++one) pieces.insert(static_cast<int>(one->second->time_s / kPieceOfShape));
    return static_cast<double>(to - from) * flown_.width_s >= kLeastShape && pieces.size() >= 3;
  }

  /// Shapes are told by gaps in φ; where the arms went slowly through many, knots are some 15° apart.
  void take_knots() {
    ByPhi all;
    for (const FlownBin& bin : flown_.bins) all.emplace_back(*std::ranges::max_element(bin.phi) * 180 / kPi, &bin);
    std::ranges::sort(all);
    const auto at_least = [&](double phi) {
      return std::ranges::lower_bound(all, phi, {}, [](const auto& one) { return one.first; });
    };
    std::vector<double>& knots = flown_.excitation.knots_deg;
    const auto knot = [&](double phi) { knots.push_back(std::round(10 * phi) / 10); };  // as files and people name it
    const auto open = at_least(kOpen);
    for (auto from = open; from != all.cend();) {
      auto to = from + 1;
      while (to != all.cend() && to->first - (to - 1)->first < kGapOfShapes) ++to;
      const double first = from->first, span = (to - 1)->first - first;
      const double last = to == all.cend() ? flown_.excitation.widest_deg : (to - 1)->first;
      if (enough(from, to) && span < 8) {
        knot(to == all.cend() ? last : (from + (to - from) / 2)->first);
      } else if (enough(from, to)) {
        const double parts = std::clamp(std::round(span / 15), 1.0, 5.0), part = (last - first) / parts;
        if (first > 2 * kOpen) knot(first);
        for (double i = 1; i <= parts; ++i)
          if (i == parts || enough(at_least(first + (i - 1) * part), at_least(first + i * part)))
            knot(first + i * part);
      }
      from = to;
    }
    const bool is_open = enough(all.cbegin(), open);
    if (!is_open && knots.size() < 2)
      throw FitError(
          fmt::format("rotors lay over the body nearly all the time (φ {:.0f}° at most): that tells k there and not "
                      "K_T; fly the open shape, too, for 20 s in three pieces",
                      flown_.excitation.widest_deg));
    // Two shapes that both cover rotors tell a line through both, and K_T where it begins.
    if (!is_open) knots.erase(knots.begin());
    if (!knots.empty()) return;
    flown_.left_out.folded = static_cast<std::size_t>(all.cend() - open);
    std::size_t kept = 0;
    for (std::size_t b = 0; b < flown_.bins.size(); ++b) {
      if (!(*std::ranges::max_element(flown_.bins[b].phi) * 180 / kPi < kOpen)) continue;
      flown_.bins[kept] = flown_.bins[b];
      flown_.first[kept++] = flown_.first[b];
    }
    flown_.bins.resize(kept);
    flown_.first.resize(kept);
    flown_.excitation.seconds = static_cast<double>(kept) * flown_.width_s;
  }

  const FlightLog& log_;
  const LoggedVehicle& vehicle_;
  std::size_t rotors_;
  FlownBins flown_;
  flight::Vehicle scene_;
  double begin_ = 0, end_ = 0;
};

}  // namespace

FlownBins flown_bins(const FlightLog& log, const LoggedVehicle& vehicle) { return Cutter(log, vehicle).cut(); }

}  // namespace kphi::fit
