// Questions and answers on the line: what is sent, what may still come, what it answers, and when it passed. Keeps the
// module's receive buffer from overflowing, finds frames again after noise, gives each question its deadline. Knows
// nothing of what the questions mean. One thread; all times are bench time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/iq/entries.hpp"
#include "drivers/iq/outbox.hpp"
#include "drivers/iq/packet.hpp"
#include "drivers/iq/reading.hpp"
#include "drivers/iq/requests.hpp"
#include "drivers/iq/round_trip.hpp"
#include "drivers/iq/settings.hpp"

namespace kphi::iq {

/// What became of one question.
struct Heard {
  enum class Kind { answer, wrong_length, timeout };
  Kind kind = Kind::timeout;
  Request request;
  Packet packet;  ///< empty after a timeout
  Stamps stamps;
  Instant end{0};  ///< its last byte came; after a timeout: now

  [[nodiscard]] const Entry& entry() const noexcept { return *request.entry; }
  [[nodiscard]] bool answers(const Entry& asked) const noexcept {
    return kind == Kind::answer && request.entry == &asked;
  }
  /// In the entry's own unit; NaN unless an answer.
  [[nodiscard]] double value() const noexcept;
};

class Exchange {
 public:
  /// `settings` are completed.
  explicit Exchange(const Settings& settings);

  /// Withdraws all that has not begun to leave.
  void withdraw() noexcept { wire_free_ -= byte_time_ * static_cast<std::int64_t>(outbox_.withdraw()); }
  /// The line is another one, or was closed: nothing of before may be sent or can come.
  void change_line() noexcept;
  /// Replies of these ids (bit per id) are other sessions' on the same line: no faults.
  void set_neighbours(std::uint64_t ids) noexcept { neighbours_ = ids; }
  /// While held, only coast goes out: others have the line.
  void hold(bool held) noexcept { held_ = held; }

  /// False: it is open already, or there is no credit. Nothing has been sent then.
  bool ask(const Entry& entry, int module_id, Instant now) noexcept;
  bool tell(Outbox::Kind kind, const Packet& packet, Instant now) noexcept;
  /// Asks something harmless while something that timed out may still be answered and nothing else is open: answers to
  /// later questions show that it will not.
  void ask_fence(int module_id, Instant now) noexcept;
  /// Sets it and asks for it in one go.
  bool tell_and_ask(const Entry& entry, double value, int module_id, Instant now) noexcept;
  /// Goes before all that has not begun to leave; never refused. `padded`: behind as many zeros as end a false header
  /// in the module's parser, which has no time-out and would withhold the coast until 64 bytes have come.
  void coast(int module_id, int times, bool padded, Instant now) noexcept;

  [[nodiscard]] bool busy(const Entry& entry, int module_id) const noexcept { return requests_.busy(entry, module_id); }
  [[nodiscard]] bool fits(std::size_t bytes) const noexcept;
  /// Nothing waits to be sent or answered.
  [[nodiscard]] bool quiet() const noexcept { return requests_.none_open() && outbox_.bytes().empty(); }
  /// Position of the newest frame among all.
  [[nodiscard]] std::uint64_t order() const noexcept { return order_; }

  /// What the bytes answer. Valid until the next call of receive or advance.
  [[nodiscard]] std::span<const Heard> receive(std::span<const std::uint8_t> bytes, Instant now);
  /// What time has decided.
  [[nodiscard]] std::span<const Heard> advance(Instant now);
  [[nodiscard]] Instant deadline() const noexcept;

  [[nodiscard]] std::span<const std::uint8_t> output() const noexcept { return outbox_.bytes(); }
  void sent(std::size_t n) noexcept;

  /// The deadline that a question would get now.
  [[nodiscard]] Duration timeout() const noexcept { return timeout_.timeout(); }
  /// Round trips less wire time of questions that had the line to themselves.
  [[nodiscard]] const RoundTripHistogram& round_trips() const noexcept { return round_trips_; }
  [[nodiscard]] Counters& counters() noexcept { return counters_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  void take_packet(const Packet& packet, std::uint64_t end, Instant now);
  void stamp_arrivals(std::size_t n, Instant end, Instant now) noexcept;
  [[nodiscard]] Instant arrival_of(std::uint64_t position) const noexcept {
    return arrivals_[position % kArrivals].on_wire;
  }
  /// When it was handed to this host: never too early, where the other is reckoned.
  [[nodiscard]] Instant reading_of(std::uint64_t position) const noexcept {
    return arrivals_[position % kArrivals].read;
  }
  [[nodiscard]] Instant begun(std::uint64_t position) const noexcept {
    return wire_paces_ ? arrival_of(position) : reading_of(position);
  }
  [[nodiscard]] Instant understood_until(Instant now) const noexcept;
  void count_parser() noexcept;
  [[nodiscard]] Duration patience() const noexcept;
  void learn(const Request& request, std::size_t reply_bytes, Instant end) noexcept;
  Request on_wire(const Entry* entry, int module_id, std::size_t bytes, Instant now) noexcept;

  Duration longest_timeout_, byte_time_;
  bool wire_paces_;
  std::size_t credit_bytes_;
  std::uint64_t own_ids_ = 0;  ///< that were ever asked
  std::uint64_t neighbours_ = 0;
  bool held_ = false;
  Parser parser_;
  static constexpr std::size_t kArrivals = 2 * kMaxFrame;
  struct Arrival {
    Instant on_wire{0}, read{0};
  };
  std::array<Arrival, kArrivals> arrivals_{};  ///< of the last bytes, by position
  Instant last_chunk_{0};
  Outbox outbox_;
  Requests requests_;
  std::size_t fence_ = 0;  ///< the next one
  std::uint64_t order_ = 0;
  Instant wire_free_{0};  ///< when the last byte handed over will have left
  AdaptiveTimeout timeout_;
  RoundTripHistogram round_trips_;
  Counters counters_;
  std::vector<Heard> heard_;
};

}  // namespace kphi::iq
