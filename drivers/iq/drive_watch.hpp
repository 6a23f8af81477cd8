// Whether the module still drives as it was told to. It may have stopped by itself meanwhile: by its communication
// timeout, a fault, an order from another program. A speed sent then would start a rotor that was let go, so each speed
// but the first of a spin waits until the module has just said, to a question put after the speed before, that it
// drives. All times are bench time.
#pragma once

#include <optional>

#include "drivers/iq/codes.hpp"
#include "drivers/iq/exchange.hpp"

namespace kphi::iq {

class DriveWatch {
 public:
  /// `settings` are completed.
  explicit DriveWatch(const Settings& settings)
      : module_id_(settings.module_id),
        settles_(settings.reply_timeout / 2),
        fresh_(settings.reply_timeout / 4),
        longest_(settings.longest_silence * 9 / 10) {}

  /// The motor is to turn, from rest.
  void begin(Instant now) noexcept;
  /// Coast was ordered.
  void end() noexcept { watching_ = false; }
  /// A speed was handed to the line.
  void told(std::uint64_t order, Instant now) noexcept;
  /// The next speed may go; asks the module when it has not yet said that it drives.
  [[nodiscard]] bool may_tell(Exchange& exchange, Instant now) noexcept;
  /// The drive mode, when it is not that of a driven motor.
  [[nodiscard]] std::optional<DriveMode> take(const Heard& heard) noexcept;
  struct Lapse {
    bool of_host = false;  ///< nobody served the session; else: the module was not heard
    Duration lasts{0};
  };
  /// A silence so long that the module may have let the motor go by its own timeout. To be called whenever the session
  /// is served, before anything is sent.
  [[nodiscard]] std::optional<Lapse> lapsed(Instant last_reply, Instant now) noexcept;

 private:
  int module_id_;
  Duration settles_;  ///< from a speed to the drive mode that follows from it
  Duration fresh_;    ///< age of an answer that still holds
  Duration longest_;  ///< silence after which the module's own timeout may have run out
  bool watching_ = false;
  std::optional<std::uint64_t> order_;  ///< of the last speed; nullopt: none in this spin
  Instant told_at_{0}, served_{0};
  std::optional<Instant> drives_at_;  ///< when it said so, asked after the last speed
};

}  // namespace kphi::iq
