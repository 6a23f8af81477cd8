// The conversation with one IQ / Vertiq speed module, as a state machine: bytes and the time go in, bytes to send,
// readings and the next deadline come out. No port, thread or clock. One thread. All times are bench time.
//
// Safety. The session never commands motion by itself and coasts before anything else. A coast withdraws waiting motion
// commands, goes before all other frames, and is repeated until the module reports drive mode coast. The module is set
// to coast by itself when it receives nothing for `module_timeout_s`; polling prevents that, so the session falls
// silent when the module does not confirm a coast or stops answering. After any failure the session is disarmed: it
// spins the motor again only after a new connection and an explicit rearm(). A speed is sent only to a module that is
// still driving (DriveWatch), so not after a sleep of the host, a break of the line or a timeout.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "compensation/units.hpp"
#include "drivers/iq/exchange/exchange.hpp"
#include "drivers/iq/exchange/telemetry.hpp"
#include "drivers/iq/session/connecting.hpp"
#include "drivers/iq/session/polling.hpp"
#include "drivers/iq/session/stopping.hpp"
#include "drivers/iq/wire/identity.hpp"

namespace kphi::iq {

class Session {
 public:
  enum class State { idle, connecting, ready, failed };

  /// Throws std::invalid_argument for settings that make no sense.
  explicit Session(Settings settings);

  /// Starts over: a confirmed coast; identity; sets the communication timeout, its behaviour to coast and its song to
  /// never, and reads all three back bit by bit. Ends `ready` or `failed`. After a reconnection the module must be the
  /// same one. The first connection arms it.
  void connect(Instant now);
  /// As connect, over a new line: earlier frames must not be sent, earlier replies not used.
  void connect_anew(Instant now);
  [[nodiscard]] const Settings& settings() const noexcept { return settings_; }
  [[nodiscard]] State state() const noexcept { return state_; }
  /// Why it failed; empty otherwise.
  [[nodiscard]] const std::string& failure() const noexcept { return failure_; }
  /// Complete once `ready`.
  [[nodiscard]] const AuditRecord& identity() const noexcept { return connecting_.identity(); }
  /// Moves the events out, oldest first.
  [[nodiscard]] std::vector<StreamEvent> take_events() { return std::exchange(events_, {}); }

  /// It has been ready at least once.
  [[nodiscard]] bool was_connected() const noexcept { return known_.has_value(); }
  /// It may spin: ready, and no failure since the first connection or the last rearm().
  [[nodiscard]] bool armed() const noexcept { return armed_ && state_ == State::ready; }
  /// The owner has seen the failure. Throws std::logic_error unless ready.
  void rearm();
  /// The owner reports a failure, such as a lost line. Disarms; coasts as soon as it can.
  void fail(EventKind kind, const std::string& why, Instant now);

  /// Closed-loop speed, + = counter-clockwise. Zero is a coast: commanding 0 rad/s would brake actively and feed a
  /// supply that cannot sink. Throws std::logic_error unless armed, std::invalid_argument beyond ±3450 rad/s.
  void spin_at(RadPerSec signed_speed, Instant now);
  /// In any state. Goes before all frames that have not begun to leave.
  void coast(Instant now) noexcept { coast(1, now); }
  /// The coast three times at once.
  void emergency_stop(Instant now) noexcept { coast(3, now); }
  /// Coasts, after a ramp if the settings want one; see stopping.hpp. Its end appears in stop_report(). A coast or a
  /// new speed ends the ramp.
  void stop(const StopSettings& settings, Instant now);
  /// The callers did not renew the lease in time.
  void expire_lease(Instant now);
  /// Motion was commanded and no coast since.
  [[nodiscard]] bool spinning() const noexcept { return spinning_; }
  /// The module has reported drive mode coast to a query sent after the last coast.
  [[nodiscard]] bool coasting() const noexcept { return coasting_.confirmed(); }
  /// A stop or a coast of a spinning motor is under way.
  [[nodiscard]] bool stopping() const noexcept { return stopping_.active(); }
  /// Report of the last finished stop or coast of a spinning motor; nullopt before the first.
  [[nodiscard]] const std::optional<StopReport>& stop_report() const noexcept { return stopping_.report(); }

  /// Sends queries between the polls. Throws std::invalid_argument as Inquiries::check does, std::logic_error unless
  /// ready or while others are open.
  void inquire(const std::vector<Inquiry>& inquiries, Instant now);
  [[nodiscard]] const Inquiries& inquiries() const noexcept { return inquiries_; }

  void receive(std::span<const std::uint8_t> bytes, Instant now);
  /// Does what is due: polls, time-outs, retries. Afterwards deadline() is later than `now`.
  void advance(Instant now);
  /// Bytes to send, oldest first; valid until the next non-const call.
  [[nodiscard]] std::span<const std::uint8_t> output() const noexcept { return exchange_.output(); }
  /// The first `n` of them have left.
  void sent(std::size_t n) noexcept { exchange_.sent(n); }
  /// When advance() is next needed; kNever: not until something else happens.
  [[nodiscard]] Instant deadline() const noexcept;

  /// Moves the oldest readings out, returns how many. 4096 are kept; older ones are dropped and counted.
  std::size_t take(std::span<MotorReading> out) { return polling_.take_readings(out); }
  [[nodiscard]] const Counters& counters() const noexcept { return exchange_.counters(); }
  [[nodiscard]] const DelayHistogram& round_trips() const noexcept { return exchange_.round_trips(); }
  /// The time-out that a query would get now, from the measured round trips.
  [[nodiscard]] Duration reply_timeout() const noexcept { return exchange_.timeout(); }

 private:
  void restart(Instant now);
  [[nodiscard]] Instant silence_limit() const noexcept;
  void coast(int times, Instant now) noexcept;
  void take_results(std::span<const QueryResult> result, Instant now);
  void take_restart(const QueryResult& result, Instant now);
  void service(Instant now);
  void continue_coasting(Instant now);
  void continue_connecting(Instant now);
  void continue_stopping(Instant now);
  void flush_speed(Instant now);
  void check_silence(Instant now);
  void check_drive(Instant now);
  void check_mode(const QueryResult& result, Instant now);
  void conclude_let_go(Instant now);
  void judge_round_trip(Instant now);
  void note(EventKind kind, const std::string& words, Instant now);
  [[nodiscard]] std::string why_no_answer() const;

  Settings settings_;
  State state_ = State::idle;
  std::string failure_;
  std::vector<StreamEvent> events_;
  bool armed_ = false;
  std::optional<AuditRecord> known_;  ///< of the first connection
  Exchange exchange_;
  Coasting coasting_;
  DriveWatch drive_;
  std::string let_go_;  ///< that the module stopped driving; reported once it is known whether it restarted
  Instant let_go_at_{0};
  Connecting connecting_;
  Polling polling_;
  ResetWatch reset_watch_;
  Stopping stopping_;
  Inquiries inquiries_;
  Instant last_reply_{0};
  bool spinning_ = false;
  double commanded_speed_ = 0;         ///< rad/s, the last one
  std::optional<float> wanted_speed_;  ///< waits for credit
  bool round_trip_judged_ = false;
  DelayHistogram judged_until_;  ///< when this spin began
};

}  // namespace kphi::iq
