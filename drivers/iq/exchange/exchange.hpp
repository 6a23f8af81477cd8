// Queries and replies on the line: which reply answers which query, and when it passed. Keeps the module's receive
// buffer from overflowing, finds frames again after noise, gives each query its deadline. Does not know what the
// entries mean. One thread; all times are bench time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/histogram.hpp"
#include "drivers/iq/exchange/requests.hpp"
#include "drivers/iq/exchange/telemetry.hpp"
#include "drivers/iq/exchange/tx_queue.hpp"
#include "drivers/iq/wire/entries.hpp"
#include "drivers/iq/wire/packet.hpp"

namespace kphi::iq {

/// The outcome of one query.
struct QueryResult {
  enum class Kind { answer, wrong_length, timeout };
  Kind kind = Kind::timeout;
  Request request;
  Packet packet;   ///< empty after a timeout
  Instant end{0};  ///< its last byte arrived; after a timeout: now
  /// When the module read the value: the middle of the span from the end of the query to the beginning of the reply,
  /// and half of that span.
  Instant time{0};
  Duration uncertainty{0};

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

  /// Withdraws all frames that have not begun to leave.
  void withdraw() noexcept { wire_free_ -= byte_time_ * static_cast<std::int64_t>(tx_queue_.withdraw()); }
  /// The line is a new one, or was closed: earlier frames must not be sent, and no reply to them can come.
  void change_line() noexcept;

  /// False: it is open already, or there is no credit; then nothing has been sent.
  bool ask(const Entry& entry, int module_id, Instant now) noexcept;
  bool tell(TxQueue::Kind kind, const Packet& packet, Instant now) noexcept;
  /// A barrier query: asks something harmless while an expired request may still be answered and nothing else is open.
  /// Answers to later requests show that no late reply can come.
  void ask_barrier(int module_id, Instant now) noexcept;
  /// Sets it and asks for it in one go.
  bool tell_and_ask(const Entry& entry, double value, int module_id, Instant now) noexcept;
  /// Goes before all frames that have not begun to leave; never refused. `padded`: after enough zeros to end a false
  /// header in the module's parser, which has no time-out and would withhold the coast until 64 bytes have arrived.
  void coast(int module_id, int times, bool padded, Instant now) noexcept;

  [[nodiscard]] bool busy(const Entry& entry, int module_id) const noexcept { return requests_.busy(entry, module_id); }
  [[nodiscard]] bool fits(std::size_t bytes) const noexcept;
  /// Position of the newest frame among all frames.
  [[nodiscard]] std::uint64_t order() const noexcept { return order_; }

  /// The queries that these bytes answer. Valid until the next call of receive or advance.
  [[nodiscard]] std::span<const QueryResult> receive(std::span<const std::uint8_t> bytes, Instant now);
  /// The queries that timed out.
  [[nodiscard]] std::span<const QueryResult> advance(Instant now);
  [[nodiscard]] Instant deadline() const noexcept;

  [[nodiscard]] std::span<const std::uint8_t> output() const noexcept { return tx_queue_.bytes(); }
  void sent(std::size_t n) noexcept;

  /// The time-out that a query would get now.
  [[nodiscard]] Duration timeout() const noexcept { return timeout_.timeout(); }
  /// Round trips less wire time, of queries that had the line to themselves.
  [[nodiscard]] const DelayHistogram& round_trips() const noexcept { return round_trips_; }
  [[nodiscard]] Counters& counters() noexcept { return counters_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  void take_packet(const Packet& packet, std::uint64_t end);
  void stamp_arrivals(std::size_t n, Instant end, Instant now) noexcept;
  [[nodiscard]] Instant arrival_of(std::uint64_t position) const noexcept {
    return arrivals_[position % kArrivals].on_wire;
  }
  /// When it was read by this host: never too early, whereas the other is computed.
  [[nodiscard]] Instant reading_of(std::uint64_t position) const noexcept {
    return arrivals_[position % kArrivals].read;
  }
  [[nodiscard]] Instant begun(std::uint64_t position) const noexcept {
    return wire_paces_ ? arrival_of(position) : reading_of(position);
  }
  [[nodiscard]] Instant understood_until(Instant now) const noexcept;
  [[nodiscard]] Duration patience() const noexcept;
  void learn(const Request& request, std::size_t reply_bytes, Instant end) noexcept;
  Request on_wire(const Entry* entry, int module_id, std::size_t bytes, Instant now) noexcept;

  Duration longest_timeout_, byte_time_;
  bool wire_paces_;
  std::size_t credit_bytes_;
  std::uint64_t own_ids_ = 0;  ///< queried so far
  Parser parser_;
  static constexpr std::size_t kArrivals = 2 * kMaxFrame;
  struct Arrival {
    Instant on_wire{0}, read{0};
  };
  std::array<Arrival, kArrivals> arrivals_{};  ///< of the last bytes, by position
  Instant last_chunk_{0};
  TxQueue tx_queue_;
  Requests requests_;
  std::size_t barrier_ = 0;  ///< the next one
  std::uint64_t order_ = 0;
  Instant wire_free_{0};  ///< when the last byte handed over will have left
  AdaptiveTimeout timeout_;
  DelayHistogram round_trips_;
  Counters counters_;
  std::vector<QueryResult> results_;
};

}  // namespace kphi::iq
