// The safety rules of a session, a class each: a coast that the module must confirm, the stop of a spinning motor with
// its report, and detecting that the module stopped driving the motor by itself or restarted by itself. Speeds in
// rad/s, times in bench time.
#pragma once

#include <algorithm>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "drivers/iq/exchange/exchange.hpp"
#include "drivers/iq/wire/codes.hpp"
#include "drivers/iq/wire/identity.hpp"

namespace kphi::iq {

/// A coast, repeated until the module reports drive mode coast to a query sent afterwards. If it does not, the session
/// falls silent so that the module's own communication timeout can end the motion, and then starts again, without end.
/// At the latest after five replies in time, and sooner if the module replies five times that it goes on driving: what
/// it hears meanwhile keeps its timeout from ending that.
class Coasting {
 public:
  /// `settings` are completed.
  explicit Coasting(const Settings& settings);

  /// Sends it `times` times at once, and asks. Sends nothing during the silence, which leaves the motor to the module's
  /// own timeout.
  void begin(Exchange& exchange, int times, Instant now) noexcept;
  /// Motion was commanded.
  void end() noexcept { pending_ = confirmed_ = false; }
  void take(const QueryResult& result, const Exchange& exchange) noexcept;
  /// Does what is due. True when it has just given up.
  [[nodiscard]] bool advance(Exchange& exchange, Instant now) noexcept;
  [[nodiscard]] Instant deadline() const noexcept {
    if (!pending_) return kNever;
    return blocked_ ? next_ : std::min(next_, ask_at_);
  }

  [[nodiscard]] bool pending() const noexcept { return pending_; }
  [[nodiscard]] bool confirmed() const noexcept { return confirmed_; }
  /// Given up for now: nothing must be sent.
  [[nodiscard]] bool silent() const noexcept { return pending_ && attempts_ == 0; }
  /// The drive mode last reported, to any query; -1 before the first.
  [[nodiscard]] int last_mode() const noexcept { return last_mode_; }
  void forget_mode() noexcept { last_mode_ = -1; }

 private:
  void ask(Exchange& exchange, Instant now) noexcept;
  [[nodiscard]] bool has_tried_enough(Instant now) const noexcept;

  int module_id_;
  Duration reply_timeout_, silence_;
  bool pending_ = false, confirmed_ = false;
  std::uint64_t order_ = 0;  ///< of the first coast
  Instant begun_{0};
  int attempts_ = 0, denials_ = 0;
  Instant next_{0};
  Instant ask_at_{kNever};
  bool blocked_ = false;  ///< the query is due but had no room: it goes before any poll
  int last_mode_ = -1;
};

struct StopSettings {
  /// rad/s², 100..100000. A ramp feeds current back: at 1000 an IQ 2306 raises a 12 V supply that cannot sink current
  /// to 18.7 V. nullopt: the motor coasts at once.
  std::optional<double> deceleration;
  double coast_below = 500;                   ///< rad/s: below it a ramp ends and the motor coasts
  double standing_below = 10;                 ///< rad/s
  Duration limit = std::chrono::seconds(10);  ///< from the coast to standstill
};

struct StopReport {
  enum class Outcome {
    standing,     ///< drive mode coast is confirmed and the speed fell below the threshold
    slowing,      ///< confirmed, and the speed was falling when the limit came
    turning,      ///< confirmed, but the speed does not fall
    unseen,       ///< confirmed, but no speed was read afterwards
    unconfirmed,  ///< the module did not confirm; its own communication timeout must coast the motor
    overruled,    ///< motion was commanded before the end
  };
  Outcome outcome = Outcome::unconfirmed;
  double speed_at_start = 0;  ///< rad/s
  double speed_at_end = 0;
  std::optional<Duration> time_to_coast;     ///< from the request to the module's report of drive mode coast
  std::optional<Duration> time_to_standing;  ///< from the request to the first speed below the threshold

  /// The module has confirmed that it does not drive the motor.
  [[nodiscard]] bool safe() const noexcept { return outcome != Outcome::unconfirmed && outcome != Outcome::overruled; }
  /// One line: "coast confirmed after 0.01 s, at rest after 2.30 s".
  [[nodiscard]] std::string summary() const;
};

/// The motor coasts at once, or, on a supply that can sink current fed back by the rotor, ramps down first. The stop
/// ends when the module reports drive mode coast and the propeller is at rest.
class Stopping {
 public:
  /// Throws std::invalid_argument for settings that make no sense.
  static void check(const StopSettings& settings);

  /// From `speed`, signed; `ramped` else coasting at once.
  void begin(const StopSettings& settings, double speed, bool ramped, Instant now) noexcept;
  /// The speed to command now, zero: coast; nullopt: not ramping, or no new speed is due.
  [[nodiscard]] std::optional<double> ramp(Instant now) noexcept;
  void coasted(Instant now) noexcept;
  void confirmed(Instant now) noexcept;
  void measured(double speed, Instant time) noexcept;
  /// Ends the stop when it is complete or its limit has passed.
  void advance(Instant now) noexcept;
  void end(StopReport::Outcome outcome) noexcept;

  [[nodiscard]] bool active() const noexcept { return phase_ != Phase::none; }
  [[nodiscard]] Instant deadline() const noexcept;
  /// The report of the last stop that ended.
  [[nodiscard]] const std::optional<StopReport>& report() const noexcept { return report_; }

 private:
  enum class Phase { none, ramping, coasting };

  Phase phase_ = Phase::none;
  StopSettings settings_;
  Instant asked_{0}, next_{0}, coasted_{0};
  double speed_at_coast_ = 0, speed_ = 0;
  bool measured_after_coast_ = false;
  StopReport open_;
  std::optional<StopReport> report_;
};

/// Checks that the module still drives the motor as commanded. It may have stopped by itself: by its communication
/// timeout, a fault, a command from another program. A speed sent then would restart a coasting rotor, so each speed
/// but the first of a spin waits until the module has reported, to a query sent after the previous speed, that it is
/// driving. All times are bench time.
class DriveWatch {
 public:
  /// `settings` are completed.
  explicit DriveWatch(const Settings& settings)
      : module_id_(settings.module_id),
        settles_(settings.reply_timeout / 2),
        fresh_(settings.reply_timeout / 4),
        longest_(settings.longest_silence * 9 / 10) {}

  /// A spin begins, from rest.
  void begin(Instant now) noexcept;
  /// Coast was ordered.
  void end() noexcept { watching_ = false; }
  /// A speed was handed to the line.
  void told(std::uint64_t order, Instant now) noexcept;
  /// Whether the next speed may be sent; queries the module when it has not yet reported that it is driving.
  [[nodiscard]] bool may_tell(Exchange& exchange, Instant now) noexcept;
  /// The drive mode reported, unless it shows a driven motor.
  [[nodiscard]] std::optional<DriveMode> take(const QueryResult& result) noexcept;
  struct Lapse {
    bool of_host = false;  ///< the session was not served; otherwise the module did not answer
    Duration lasts{0};
  };
  /// A silence so long that the module's own timeout may have coasted the motor. To be called whenever the session is
  /// served, before anything is sent.
  [[nodiscard]] std::optional<Lapse> lapsed(Instant last_reply, Instant now) noexcept;

 private:
  int module_id_;
  Duration settles_;  ///< from a speed to the drive mode that results from it
  Duration fresh_;    ///< age up to which an answer is valid
  Duration longest_;  ///< silence after which the module's own timeout may have run out
  bool watching_ = false;
  std::optional<std::uint64_t> order_;  ///< position of the last speed; nullopt: no speed in this spin
  Instant told_at_{0}, served_{0};
  std::optional<Instant> drives_at_;  ///< when it reported driving, asked after the last speed
};

/// Detects a restart: the module's uptime goes backwards or lags behind the time that passed, or fault_ever gains the
/// under-voltage bit. A restart loses
/// every volatile setting, the communication timeout first of all.
class ResetWatch {
 public:
  /// A connection begins: what is read first is what is compared with.
  void begin() noexcept { *this = {}; }
  /// One of the two entries is being set: accepts any next value.
  void expect_new_time() noexcept { uptime_.reset(); }
  /// The evidence of a restart; nullopt: no restart.
  [[nodiscard]] std::optional<std::string> take(const QueryResult& result);

 private:
  struct Uptime {
    double seconds;  ///< of the module
    Instant latest;  ///< it was read no later
  };
  std::optional<Uptime> uptime_;
  std::optional<int> faults_;  ///< bits that were there before
};

}  // namespace kphi::iq
