// Two safety rules: detect that the module stopped driving the motor by itself, and that it restarted by itself.
#pragma once

#include <optional>
#include <string>

#include "drivers/iq/exchange/exchange.hpp"
#include "drivers/iq/wire/codes.hpp"
#include "drivers/iq/wire/identity.hpp"

namespace kphi::iq {

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

/// Detects a restart: the module's uptime goes backwards, or fault_ever gains the under-voltage bit. A restart loses
/// every volatile setting, the communication timeout first of all.
class ResetWatch {
 public:
  void begin(const Identity& identity) noexcept;
  /// One of the two entries is being set: accepts any next value.
  void expect_new_time() noexcept { uptime_.reset(); }
  /// The evidence of a restart; nullopt: no restart.
  [[nodiscard]] std::optional<std::string> take(const QueryResult& result);

 private:
  std::optional<double> uptime_;  ///< seconds of the module
  int faults_ = 0;                ///< bits that were there before
};

}  // namespace kphi::iq
