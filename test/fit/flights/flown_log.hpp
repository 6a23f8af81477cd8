// Flights of a foldable drone with physics of their own, as a flight controller would log them: a rigid body under a
// simple controller, rotors with lag, inflow, drag and gusts, and sensors that are off, late, coarse and shaken. Shares
// no line with what `kphi fly` flies or what the fit computes; even φ is counted here, point by point of the rim.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "base/random.hpp"
#include "fit/flights/flight_log.hpp"

namespace kphi::fit::flown_log {

enum class Kind : std::uint8_t { hover_steps, circles, arms_moving, commands, damaged, wrong_mass };
inline constexpr std::array kKinds{Kind::hover_steps, Kind::circles, Kind::arms_moving,
                                   Kind::commands,    Kind::damaged, Kind::wrong_mass};
[[nodiscard]] inline const char* name_of(Kind kind) {
  constexpr std::array names{"hover steps", "circles", "arms moving", "commands", "damaged", "wrong mass"};
  return names[static_cast<std::size_t>(kind)];
}

inline constexpr double kHalfSide = 0.045, kArm = 0.117, kRadius = 0.0635, kG = 9.80665, kFull = 2000.15;
inline constexpr double kX = std::numbers::pi / 4, kO = std::numbers::pi;

/// What is true of one flight.
struct Truth {
  double k_t = 1.55e-6;                     ///< N/(rad/s)², mean of the rotors
  double fall = 0.155;                      ///< share of K_T lost per rad of φ
  double lag_s = 0.04;                      ///< of the rotors' speed behind the command
  double law = 0.6;                         ///< share of u² in the law of throttle
  double mass_kg = 0.6;                     ///< of the drone as it flew
  double told_kg = 0.6;                     ///< of the drone as it was weighed
  double told_speed = 1;                    ///< of the speeds as logged, over the true ones
  int weak = -1;                            ///< rotor with a damaged propeller
  double weakness = 0;                      ///< share of its thrust
  std::array<double, 4> share{1, 1, 1, 1};  ///< of each rotor, of the mean
  [[nodiscard]] double ratio(double phi_rad) const { return 1 - fall * phi_rad; }
};

struct FlownLog {
  FlightLog log;
  Truth truth;
};

struct Settings {
  double seconds = 120;
  double mass_u = 0.003, scale_u = 0.005, bias_u = 0.05, full_u = 0.05,
         speed_u = 0.002;  ///< standard deviations that are drawn
  double weakness = 0.05;
  double excitation = 1;  ///< of steps in place, height and yaw
  double shake = 1;       ///< of the vibration
  bool with_climb = true, with_height = true;
};

/// Arc of a propeller's rim over the square, by the angle of its arm: 7200 points of the rim are counted.
[[nodiscard]] inline double counted_arc(double arm) {
  static const std::vector<double> table = [] {
    std::vector<double> arcs;
    for (int i = 0; i <= 2700; ++i) {
      const double theta = (0.1 * i - 90) * std::numbers::pi / 180;
      int inside = 0;
      for (int j = 0; j < 7200; ++j) {
        const double rim = j * std::numbers::pi / 3600;
        const double x = kHalfSide + kArm * std::cos(theta) + kRadius * std::cos(rim);
        const double y = kHalfSide + kArm * std::sin(theta) + kRadius * std::sin(rim);
        inside += std::abs(x) <= kHalfSide && std::abs(y) <= kHalfSide ? 1 : 0;
      }
      arcs.push_back(inside * std::numbers::pi / 3600);
    }
    return arcs;
  }();
  const double at = std::clamp((arm * 180 / std::numbers::pi + 90) * 10, 0.0, 2699.999);
  const auto i = static_cast<std::size_t>(at);
  return table[i] + (at - static_cast<double>(i)) * (table[i + 1] - table[i]);
}

/// A value that wanders about zero (Ornstein, Uhlenbeck).
struct Wander {
  double deviation, memory_s, value = 0;
  double step(double dt, Random& random) {
    const double keep = std::exp(-dt / memory_s);
    return value = keep * value + deviation * std::sqrt(1 - keep * keep) * random.normal();
  }
};

class Drone {
 public:
  Drone(Kind kind, std::uint64_t seed, const Settings& settings) : kind_(kind), settings_(settings), random_(seed) {
    for (int warm = 0; warm < 8; ++warm) (void)random_.bits();
    truth_.k_t *= 1 + 0.1 * random_.symmetric();
    truth_.fall *= 1 + 0.3 * random_.symmetric();
    truth_.lag_s = 0.045 + 0.02 * random_.symmetric();
    truth_.law = 0.65 + 0.25 * random_.symmetric();
    truth_.told_kg = truth_.mass_kg / (1 + settings.mass_u * random_.normal());
    if (kind == Kind::wrong_mass) truth_.told_kg *= random_.symmetric() > 0 ? 1.06 : 0.94;
    if (kind == Kind::damaged) {
      truth_.weak = static_cast<int>(random_.bits() % 4);
      truth_.weakness = settings.weakness;
    }
    double mean = 0;
    for (int i = 0; i < 4; ++i) {
      share_[i] = 1 + 0.01 * random_.normal() - (i == truth_.weak ? truth_.weakness : 0);
      mean += share_[i] / 4;
    }
    truth_.k_t *= mean;
    for (double& one : share_) one /= mean;
    cog_off_ = {0.002 * random_.normal(), 0.002 * random_.normal(), 0};
    imu_ = {0.005 * random_.normal(), 0.005 * random_.normal(), 0.003 * random_.normal()};
    scale_ = 1 + settings.scale_u * random_.normal();
    for (double& one : bias_) one = settings.bias_u * random_.normal();
    inflow_ = 3 + random_.symmetric();
    lift_ = 2 + 2 * random_.symmetric();
    side_drag_ = 0.3 + 0.1 * random_.symmetric();
    const double gust = 0.15 + 0.1 * random_.symmetric();
    wind_ = {Wander{gust, 1.5}, Wander{gust, 1.5}, Wander{0.5 * gust, 1.0}};
    shake_ = settings.shake * (0.8 + 0.6 * random_.symmetric());
    sag_ = kind == Kind::commands ? 0.5 + 0.5 * random_.symmetric() : 0;
    full_ = kFull * (1 + settings.full_u * random_.normal());
    speed_off_ = settings.speed_u * random_.normal();
    truth_.told_speed = 1 + speed_off_;
    stamp_s_ = 0.001 * random_.normal();  // the task that stamps commands is not that of the accelerometer
    offset_s_ = 0.008 + 0.007 * random_.symmetric();
    constexpr std::array steps{1, 2, 5};  // 500, 250, 100 Hz
    log_every_ = steps[random_.bits() % 3];
    for (double& one : arms_) one = kX;
  }

  FlownLog fly() {
    FlownLog out;
    FlightLog& log = out.log;
    log.format = "generated";
    log.rotor_speed.resize(kind_ == Kind::commands ? 0 : 4);
    log.command.resize(kind_ == Kind::commands ? 4 : 0);
    log.arm_angle.resize(4);
    const int steps = static_cast<int>(settings_.seconds / kStep);
    for (int n = 0; n < steps; ++n) {
      const double t = n * kStep;
      refer(t);
      move_arms(t);
      control();
      advance();
      record(n, t, t + kStep, log);
    }
    for (int i = 0; i < 4; ++i) truth_.share[i] = share_[i];
    out.truth = truth_;
    return out;
  }

 private:
  using V = Eigen::Vector3d;
  static constexpr double kStep = 0.002, kYawArm = 0.0133, kNominalK = 1.55e-6;
  static constexpr std::array<double, 4> kSpin{1, -1, 1, -1};

  /// Where it should be: steps in place, height and yaw, or a circle; up at the beginning, down at the end.
  void refer(double t) {
    const double e = settings_.excitation;
    const auto step = [&](double every, double shift) {
      const auto n = static_cast<std::uint64_t>((t + shift) / every);
      return static_cast<double>(SplitMix64(n * 77 + static_cast<std::uint64_t>(shift * 10))() >> 11) * 0x1p-52 - 1;
    };
    const double up = std::clamp(t / 3, 0.0, 1.0) * std::clamp((settings_.seconds - 2 - t) / 3, 0.0, 1.0);
    if (kind_ == Kind::circles) {
      const double turn = 1.0, radius = 1.5 * std::clamp(t / 20, 0.0, 1.0);
      want_ = {radius * std::cos(turn * t), radius * std::sin(turn * t), up * (1.5 + 0.25 * e * std::sin(0.7 * t))};
      yaw_ = 0.5 * e * step(4, 0.3);
      return;
    }
    want_ = {0.5 * e * step(3.1, 1.1), 0.5 * e * step(3.7, 2.2), up * (1.5 + 0.4 * e * step(4.3, 3.3))};
    yaw_ = 0.6 * e * step(3.3, 4.4);
  }

  /// X and O by turns, a movement of 1.5 s every 8 s.
  void move_arms(double t) {
    if (kind_ == Kind::hover_steps || kind_ == Kind::circles) return;
    const double cycle = std::fmod(t, 16), part = 1.5;
    const double into = std::clamp((cycle - 6.5) / part, 0.0, 1.0) - std::clamp((cycle - 14.5) / part, 0.0, 1.0);
    const double s = into * into * (3 - 2 * into);
    for (int i = 0; i < 4; ++i) arms_[i] = kX + s * ((i == 2 ? kO - 0.25 : kO) - kX);
  }

  [[nodiscard]] V hub(int i) const {
    const double x = kHalfSide + kArm * std::cos(arms_[i]), y = kHalfSide + kArm * std::sin(arms_[i]);
    constexpr std::array<double, 4> c{1, 0, -1, 0}, s{0, 1, 0, -1};
    return {c[i] * x - s[i] * y, s[i] * x + c[i] * y, 0};
  }

  void control() {
    const V miss = want_ - place_;
    sum_ = (sum_ + 1.5 * kStep * miss).cwiseMax(-3).cwiseMin(3);
    V ask = 4 * miss.cwiseMax(-0.6).cwiseMin(0.6) - 3.2 * speed_ + sum_;
    if (place_.z() <= 0.001 && want_.z() < 0.02) ask.z() = -7, sum_.setZero();
    ask.z() += kG;
    const Eigen::Matrix3d r = attitude_.toRotationMatrix();
    const double collective = 0.6 * ask.dot(r.col(2));
    const V heading(std::cos(yaw_), std::sin(yaw_), 0), zb = ask.normalized(), yb = zb.cross(heading).normalized();
    Eigen::Matrix3d target;
    target << yb.cross(zb), yb, zb;
    const Eigen::Matrix3d off = target.transpose() * r - r.transpose() * target;
    const V tilt(off(2, 1) / 2, off(0, 2) / 2, off(1, 0) / 2);
    V turn = -9 * tilt;
    turn.z() /= 3;
    const V lag = turn - rate_;
    sum_rate_ = (sum_rate_ + kStep * lag).cwiseMax(-2).cwiseMin(2);
    const V torque = inertia() * (16 * lag + 20 * sum_rate_);
    Eigen::Matrix4d mix;
    for (int i = 0; i < 4; ++i) {
      const V at = hub(i) - nominal_cog();
      mix.col(i) << 1, at.y(), -at.x(), kSpin[i] * kYawArm;
    }
    const Eigen::Vector4d thrust =
        mix.colPivHouseholderQr().solve(Eigen::Vector4d(collective, torque.x(), torque.y(), 0.3 * torque.z()));
    for (int i = 0; i < 4; ++i) {
      const double wanted = std::sqrt(std::clamp(thrust[i], 0.05, 5.5) / kNominalK);
      const double share = wanted * wanted / (kFull * kFull), straight = 1 - truth_.law;
      throttle_[i] =
          std::clamp(2 * share / (straight + std::sqrt(straight * straight + 4 * truth_.law * share)), 0.0, 1.0);
    }
  }

  [[nodiscard]] V nominal_cog() const {
    V sum = V::Zero();
    for (int i = 0; i < 4; ++i) sum += 0.045 / 0.6 * hub(i);
    return sum;
  }
  /// Of a plate of 0.42 kg and four points at the hubs.
  [[nodiscard]] Eigen::Matrix3d inertia() const {
    const double plate = 0.42 / 12, side = 4 * kHalfSide * kHalfSide;
    Eigen::Matrix3d sum = V(plate * (side + 0.0016), plate * (side + 0.0016), plate * 2 * side).asDiagonal();
    const V cog = nominal_cog();
    const auto add = [&](double mass, const V& at) {
      sum += mass * (at.squaredNorm() * Eigen::Matrix3d::Identity() - at * at.transpose());
    };
    add(0.42, cog);
    for (int i = 0; i < 4; ++i) add(0.045, hub(i) - cog);
    return sum;
  }

  void advance() {
    V gust;
    for (int i = 0; i < 3; ++i) gust[i] = wind_[static_cast<std::size_t>(i)].step(kStep, random_);
    const Eigen::Matrix3d r = attitude_.toRotationMatrix();
    const V air = r.transpose() * (speed_ - gust), cog = nominal_cog() + cog_off_;
    const double volt = 1 - 0.08 * (clock_ / settings_.seconds - 0.5);
    V force = V::Zero(), torque = V::Zero();
    for (int i = 0; i < 4; ++i) {
      const double full = full_ * (1 + sag_ * (volt - 1));
      const double aim = full * std::sqrt(truth_.law * throttle_[i] * throttle_[i] + (1 - truth_.law) * throttle_[i]);
      const double before = omega_[i];
      omega_[i] += (1 - std::exp(-kStep / truth_.lag_s)) * (aim - omega_[i]);
      const double turns = (before + omega_[i]) / 2;  // over the step
      angle_[i] += kStep * turns;
      const double tip = std::max(turns, 50.0) * kRadius;
      const double bench = truth_.k_t * share_[i] * truth_.ratio(counted_arc(arms_[i])) * turns * turns;
      const double thrust =
          bench * (1 - inflow_ * air.z() / tip + lift_ * (air.x() * air.x() + air.y() * air.y()) / (tip * tip));
      force.z() += thrust;
      const V at = hub(i) - cog;
      torque += V(at.y() * thrust, -at.x() * thrust, kSpin[i] * kYawArm * kNominalK * turns * turns);
    }
    force -= truth_.mass_kg * V(side_drag_ * air.x(), side_drag_ * air.y(), 0.08 * air.z());
    const Eigen::Matrix3d j = inertia();
    V turning = j.inverse() * (torque - rate_.cross(j * rate_));
    V feels = force / truth_.mass_kg;
    V moves = r * feels - V(0, 0, kG);
    if (place_.z() <= 0 && moves.z() <= 0) {
      moves.setZero(), turning.setZero(), speed_.setZero(), rate_.setZero(), sum_rate_.setZero();
      attitude_.setIdentity();
      feels = V(0, 0, kG);
    }
    const V arm = imu_ - cog;
    felt_ = feels + turning.cross(arm) + rate_.cross(rate_.cross(arm));
    speed_ += kStep * moves;
    place_ += kStep * speed_;
    if (place_.z() < 0) place_.z() = 0;
    rate_ += kStep * turning;
    const V half = 0.5 * kStep * rate_;
    attitude_ = (attitude_ * Eigen::Quaterniond(1, half.x(), half.y(), half.z())).normalized();
    clock_ += kStep;
  }

  void record(int n, double ordered, double t, FlightLog& log) {
    const auto put = [&](FlightChannel& to, double at, double value) {
      to.time_s.push_back(at);
      to.values.push_back(value);
    };
    if (n % log_every_ == 0) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        double shaken = 0;
        for (int i = 0; i < 4; ++i)
          shaken += std::sin(2 * angle_[i] + static_cast<double>(axis) + i) * std::pow(omega_[i] / 900, 2);
        put(log.specific_force[axis], t,
            scale_ * felt_[static_cast<Eigen::Index>(axis)] + bias_[axis] + shake_ * shaken + 0.06 * random_.normal());
        put(log.angular_rate[axis], t,
            rate_[static_cast<Eigen::Index>(axis)] + 0.004 + 0.02 * shake_ * shaken + 0.004 * random_.normal());
      }
    }
    for (int i = 0; i < 4; ++i) {
      const auto rotor = static_cast<std::size_t>(i);
      if (kind_ == Kind::commands && n % log_every_ == 0)
        put(log.command[rotor], ordered + kStep / 2 + stamp_s_, throttle_[i]);
      if (kind_ != Kind::commands && n % 10 == 2 * i) {  // each at 50 Hz, a fourteenth of 100 electrical rpm
        const double told = omega_[i] * (1 + speed_off_ + 0.002 * random_.normal()),
                     digit = 100.0 / 7 * std::numbers::pi / 30;
        put(log.rotor_speed[rotor], t + offset_s_, digit * std::round(told / digit));
      }
      if (n % 10 == i) put(log.arm_angle[rotor], t, arms_[i] + 0.002 * random_.normal());
    }
    if (n % 25 != 0) return;
    if (settings_.with_height) put(log.height, t, place_.z() + 0.02 * random_.normal());
    if (settings_.with_climb) put(log.climb, t, speed_.z() + drift_.step(0.05, random_) + 0.03 * random_.normal());
    put(log.voltage, t, 15.4 * (1 - 0.08 * (t / settings_.seconds - 0.5)) + 0.02 * random_.normal());
    put(log.density, t, 1.19 + 0.0005 * random_.normal());
  }

  Kind kind_;
  Settings settings_;
  Random random_;
  Truth truth_;
  std::array<double, 4> share_{}, arms_{}, omega_{}, angle_{}, throttle_{};
  std::array<double, 3> bias_{};
  std::array<Wander, 3> wind_{Wander{0, 1}, Wander{0, 1}, Wander{0, 1}};
  Wander drift_{0.05, 2.0};
  V cog_off_, imu_, felt_{0, 0, kG};
  V place_ = V::Zero(), speed_ = V::Zero(), rate_ = V::Zero(), sum_ = V::Zero(), sum_rate_ = V::Zero(), want_;
  Eigen::Quaterniond attitude_ = Eigen::Quaterniond::Identity();
  double scale_ = 1, inflow_ = 3, lift_ = 2, side_drag_ = 0.3, shake_ = 1, sag_ = 0, full_ = kFull, offset_s_ = 0,
         stamp_s_ = 0, speed_off_ = 0;
  double yaw_ = 0, clock_ = 0;
  int log_every_ = 2;
};

[[nodiscard]] inline FlownLog fly(Kind kind, std::uint64_t seed, const Settings& settings = {}) {
  return Drone(kind, seed, settings).fly();
}

}  // namespace kphi::fit::flown_log
