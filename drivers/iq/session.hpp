// The conversation with one IQ / Vertiq speed module, as a state machine: bytes and the time go in, bytes to send,
// readings and the next deadline come out. No port, thread or clock. One thread. All times are bench time.
//
// Safety. The session never commands motion by itself and coasts before anything else. A coast withdraws motion
// commands that wait, goes before all other frames, and is repeated until the module reports drive mode coast. The
// module is told to coast by itself when it hears nothing for `module_timeout_s`; polling keeps it from doing so,
// hence the session falls silent when the module does not confirm a coast or stops answering.
#pragma once

#include <boost/circular_buffer.hpp>
#include <optional>
#include <span>
#include <string>

#include "compensation/units.hpp"
#include "drivers/clock.hpp"
#include "drivers/iq/entries.hpp"
#include "drivers/iq/identity.hpp"
#include "drivers/iq/outbox.hpp"
#include "drivers/iq/packet.hpp"
#include "drivers/iq/reading.hpp"
#include "drivers/iq/requests.hpp"

namespace kphi::iq {

struct Settings {
  int module_id = 0;              ///< 0..62
  double telemetry_hz = 50;       ///< speed readings per second of bench time; the other quantities come in turn
  Duration reply_timeout{0};      ///< bench time; 0: 100 ms, and Motor stretches these as wall time
  Duration wire_byte_time{0};     ///< 10 bits of one byte, bench time; 0: Motor takes 10/baud
  double module_timeout_s = 0.5;  ///< the module coasts by itself after this silence; in its own seconds
  Duration longest_silence{0};    ///< the same as bench time; 0: module_timeout_s, and Motor stretches it as wall time
  std::size_t credit_bytes = 63;  ///< most bytes of unanswered frames, 18 or more: the module's receive buffer has 64
};

class Session {
 public:
  enum class State { idle, connecting, ready, failed };

  /// Throws std::invalid_argument for settings that make no sense.
  explicit Session(Settings settings);

  /// Starts over: coast and its confirmation first; identity; sets the communication timeout, its behaviour to coast
  /// and its song to never, and reads all three back bit by bit. Then `ready` or `failed`.
  void connect(Instant now);
  [[nodiscard]] const Settings& settings() const noexcept { return settings_; }
  [[nodiscard]] State state() const noexcept { return state_; }
  /// Why it failed; empty else.
  [[nodiscard]] const std::string& failure() const noexcept { return failure_; }
  /// Whole once `ready`.
  [[nodiscard]] const Identity& identity() const noexcept { return identity_; }

  /// Closed-loop speed, + = counter-clockwise. Zero is a coast: commanding 0 rad/s would brake actively and feed a
  /// supply that cannot sink. Throws std::logic_error unless ready, std::invalid_argument beyond ±3450 rad/s.
  void spin_at(RadPerSec signed_speed, Instant now);
  /// In any state. Goes before everything that has not begun to leave.
  void coast(Instant now) noexcept;
  /// Motion was commanded and no coast since.
  [[nodiscard]] bool spinning() const noexcept { return spinning_; }
  /// The module has reported drive mode coast to a question put after the last coast.
  [[nodiscard]] bool coasting() const noexcept { return coast_confirmed_; }

  void receive(std::span<const std::uint8_t> bytes, Instant now);
  /// Does what is due: polls, time-outs, retries. Afterwards deadline() is later than `now`.
  void advance(Instant now);
  /// Bytes to send, oldest first; valid until the next non-const call.
  [[nodiscard]] std::span<const std::uint8_t> output() const noexcept { return outbox_.bytes(); }
  /// The first `n` of them have left.
  void sent(std::size_t n) noexcept;
  /// When advance() is next needed; kNever: not before something else happens.
  [[nodiscard]] Instant deadline() const noexcept;

  /// Moves the oldest readings out, returns how many. 4096 are kept; older ones are dropped and counted.
  std::size_t take(std::span<Reading> out);
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  /// Time of the newest reading; zero before the first.
  [[nodiscard]] Instant newest_reading() const noexcept { return newest_reading_; }

 private:
  void take_packet(const Packet& packet, Instant end);
  void take_answer(const Request& request, const Packet& packet, Instant end);
  void take_reading(const Request& request, double value, std::size_t reply_bytes, Instant end);
  void take_step_answer(const Request& request, const Packet& packet);
  void take_drive_mode(const Request& request, double mode, Instant now);
  void take_timeout(const Request& request, Instant now);
  [[nodiscard]] Duration patience() const noexcept;
  void watch_partial(Instant now);
  void count_parser() noexcept;

  void service(Instant now);
  void continue_coasting(Instant now);
  void continue_connecting(Instant now);
  void fail_step(const char* why);
  void flush_speed(Instant now);
  void poll(Instant now);
  void check_silence(Instant now);
  void fail(const std::string& why, Instant now);
  [[nodiscard]] std::string why_no_answer() const;

  bool ask(const Entry& entry, Instant now) noexcept;
  bool tell(Outbox::Kind kind, const Packet& packet, Instant now) noexcept;
  void send_coast(Instant now) noexcept;
  Request on_wire(const Entry* entry, std::size_t bytes, Instant now) noexcept;
  [[nodiscard]] bool fits(std::size_t bytes) const noexcept;
  [[nodiscard]] const Entry* entry_of(Quantity quantity) const noexcept;

  Settings settings_;
  State state_ = State::idle;
  std::string failure_;
  Identity identity_;
  Parser parser_;
  std::uint64_t partial_offset_ = 0;
  Instant partial_since_{kNever};
  Outbox outbox_;
  Requests requests_;
  std::uint64_t order_ = 0;
  Instant wire_free_{0};  ///< when the last byte handed over will have left
  Instant last_reply_{0};

  std::size_t step_ = 0;  ///< of the connection script
  bool step_asked_ = false;
  int step_attempts_ = 0;
  std::string step_failure_;

  bool spinning_ = false;
  std::optional<float> wanted_speed_;  ///< waits for credit
  bool coast_pending_ = false;
  bool coast_confirmed_ = false;
  std::uint64_t coast_order_ = 0;
  int coast_attempts_ = 0;
  Instant coast_next_{0};
  Instant coast_ask_at_{kNever};
  int last_drive_mode_ = -1;

  Instant next_poll_{0};
  int turn_ = 0;
  boost::circular_buffer<Reading> readings_;
  Instant newest_reading_{0};
  Counters counters_;
};

}  // namespace kphi::iq
