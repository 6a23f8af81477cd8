// The RDT session with a box: starts the stream, takes its records, notices silence, stops it. A state machine:
// datagrams and the time go in; requests, records and the next deadline come out. One thread.
#pragma once

#include <array>
#include <boost/container/static_vector.hpp>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/clock.hpp"
#include "drivers/netbox/stream/events.hpp"
#include "drivers/netbox/stream/reorder_window.hpp"
#include "drivers/netbox/wire/rdt.hpp"

namespace kphi::netbox {

/// Durations in bench time.
struct StreamSettings {
  unsigned divisor = 1;                                       ///< ft_sequence per record
  int records_per_datagram = 40;                              ///< 1..40
  double device_rate_hz = 7000;                               ///< ft_sequence per second
  Duration reply_timeout = std::chrono::milliseconds(100);    ///< of the first start; added to two datagram periods
  Duration settle = std::chrono::milliseconds(5);             ///< silence after a stop before the start is sent
  Duration silence_timeout = std::chrono::milliseconds(500);  ///< added to three datagram periods
  Duration bias_patience = std::chrono::milliseconds(50);     ///< added to three datagram periods
  std::size_t reorder_records = 64;                           ///< held back at most; at least four datagrams
  Duration reorder_patience = std::chrono::milliseconds(20);  ///< and for at most this long
  Product product = Product::net_box;                         ///< selects the start command
  int attempts = 6;  ///< starts sent before giving up; the timeout doubles up to four times the first

  /// Bench time between two datagrams.
  [[nodiscard]] Duration datagram_period() const noexcept {
    return from_seconds(records_per_datagram * (divisor / device_rate_hz));
  }
  /// A stream without a record for this long is silent.
  [[nodiscard]] Duration silence() const noexcept { return silence_timeout + 3 * datagram_period(); }
};

enum class State : std::uint8_t {
  idle,
  starting,  ///< asked, no record yet
  streaming,
  silent,  ///< was streaming; streams again with the next record, or with start()
  failed,  ///< no record after all attempts of the first start
};

class Session {
 public:
  explicit Session(const StreamSettings& settings);
  /// Continues with other settings: call flush() before and start() then. With another stride the counters continue,
  /// but records missing in between are unknown.
  void adopt(const StreamSettings& settings);

  /// Stop, wait for silence, start; repeated until the first record. From `silent` or `streaming` the records missing
  /// in between are counted as lost; from `idle` or `failed` they are not.
  void start(Instant now);
  /// Tells the box to stop, and again if it keeps sending. Call flush() before: start() from `idle` drops records held
  /// back.
  void stop(Instant now);
  /// While streaming: the box takes its present load as zero. Some boxes stop their stream then, also some time later:
  /// until silence() has passed, it is started again when no record comes within three datagram periods and
  /// bias_patience. Another state: nothing is sent.
  void set_bias(Instant now);
  /// The usual case: true if the stream goes on without a gap; its records, as many as `out` holds, are there then.
  /// False: nothing has happened, call receive().
  bool receive_in_order(std::span<const std::uint8_t> datagram, Instant arrival, std::span<LoadCellRecord> out);
  /// Appends to `out` the records that can be delivered, ascending in ft_sequence. Records behind a gap are held back
  /// (StreamSettings::reorder_records and reorder_patience) and come with a later call.
  void receive(std::span<const std::uint8_t> datagram, Instant arrival, std::vector<LoadCellRecord>& out);
  /// To be called at `deadline()`, after everything that came before has been received.
  void advance(Instant now);
  /// When release() will deliver; kNever if no record is held back. Not part of deadline().
  [[nodiscard]] Instant release_deadline() const noexcept { return window_.deadline(); }
  /// Appends the records held back for too long; receive() does so too.
  void release(Instant now, std::vector<LoadCellRecord>& out) { window_.expire(now, account_, out); }
  /// Appends all records held back: the account is complete then.
  void flush(std::vector<LoadCellRecord>& out) { window_.flush(account_, out); }
  /// Pops the next request to the box; false if there is none.
  [[nodiscard]] bool next_request(std::array<std::uint8_t, 8>& request) noexcept;
  /// kNever when nothing is due.
  [[nodiscard]] Instant deadline() const noexcept;
  [[nodiscard]] State state() const noexcept;
  /// Starting again after a silence; back to `silent` if no record arrives.
  [[nodiscard]] bool resuming() const noexcept {
    return resuming_ && (phase_ == Phase::draining || phase_ == Phase::awaiting);
  }
  /// Datagrams that the socket has dropped since it was opened (SO_RXQ_OVFL), as known at the datagram received next.
  void note_host_drops(std::uint64_t total) noexcept;
  [[nodiscard]] const Counters& counters() const noexcept { return account_.counters(); }
  /// Oldest first.
  [[nodiscard]] std::vector<Event> take_events() { return std::exchange(account_.events(), {}); }
  [[nodiscard]] const StreamSettings& settings() const noexcept { return settings_; }

 private:
  enum class Phase : std::uint8_t { idle, draining, awaiting, streaming, silent, failed };

  void discard(Instant arrival);
  void check_bias(Instant now) noexcept;
  void note_status(std::span<const LoadCellRecord> records) noexcept;
  void note_silence(Instant now) noexcept;
  void note_event(EventKind kind, const LoadCellRecord& shown_by, std::uint32_t status = 0) noexcept;
  bool belongs_to_new_stream(const LoadCellRecord& first) const noexcept;
  [[nodiscard]] Command start_command() const noexcept;
  void begin_streaming() noexcept;
  void send(Command command) noexcept;
  void send_stop(Instant now) noexcept;
  void send_start(Instant now) noexcept;

  StreamSettings settings_;
  LossTracker account_;
  ReorderWindow window_;
  std::uint32_t trouble_ = 0;  // status bits that say so, of the last datagram
  Phase phase_ = Phase::idle;
  Instant due_ = kNever, bias_due_ = kNever, bias_watched_until_{0};
  Instant newest_arrival_{0};
  int bias_starts_ = 0;
  bool resuming_ = false, silence_told_ = false;
  Instant drain_limit_{0}, stop_sent_{0}, first_start_{0};
  int attempt_ = 0;
  std::size_t datagram_records_;  // of the last datagram
  std::uint64_t host_drops_ = 0;
  std::array<LoadCellRecord, kMaxRecords> decoded_{};
  boost::container::static_vector<Command, 4> requests_;
};

}  // namespace kphi::netbox
