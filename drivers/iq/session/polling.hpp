// Telemetry: when each entry is queried, and the resulting readings. Three periods: the channels of every cycle, the
// others in turn, and the two entries that reveal a restart of the module. A query that is due waits for credit; if it
// still waits one period later, it is skipped and counted.
#pragma once

#include <array>
#include <boost/circular_buffer.hpp>

#include "drivers/iq/exchange/exchange.hpp"
#include "drivers/iq/wire/identity.hpp"

namespace kphi::iq {

class Polling {
 public:
  /// `settings` are completed.
  explicit Polling(const Settings& settings);

  /// `system_control_id`: where that client answers.
  void begin(const AuditRecord& identity, int system_control_id, Instant now);
  void end() noexcept { on_ = false; }
  /// Queries the entries that reveal a restart at once.
  void look_for_restart(Instant now) noexcept { watch_.next = now; }
  void take(const QueryResult& result, Counters& counters);
  void advance(Exchange& exchange, Instant now);
  [[nodiscard]] Instant deadline() const noexcept;

  /// Moves the oldest readings out, returns how many. 4096 are kept; older ones are dropped and counted.
  std::size_t take_readings(std::span<MotorReading> out);
  /// The newest speed, rad/s; NaN before the first.
  [[nodiscard]] double speed() const noexcept { return speed_; }
  [[nodiscard]] Instant speed_time() const noexcept { return speed_time_; }

 private:
  static constexpr std::size_t kChannels = kMotorChannels.size(), kQuestions = kChannels + 2;
  struct Question {
    const Entry* entry = nullptr;  ///< nullptr: the module has no such entry
    int module_id = 0;
  };
  struct Beat {
    Duration period{0};
    Instant next{0};
    /// Whether it is due; if so, sets the next time.
    bool strike(Instant now) noexcept;
  };

  void want(std::size_t question, Counters& counters) noexcept;
  void want_slow(Counters& counters) noexcept;

  int module_id_;
  std::array<bool, kChannels> every_cycle_{};
  bool on_ = false;
  std::array<Question, kQuestions> questions_{};
  std::array<bool, kQuestions> wanted_{};
  Beat cycle_, slow_, watch_;
  std::size_t turn_ = 0;
  boost::circular_buffer<MotorReading> readings_;
  double speed_;
  Instant speed_time_{0};
};

}  // namespace kphi::iq
