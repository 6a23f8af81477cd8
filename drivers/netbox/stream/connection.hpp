// The connection to one box: starts and stops its stream, notices a silence, asks why, starts the stream again when
// the box is back, adopts a changed configuration, and queues the records for one consumer. A state machine without
// I/O: datagrams, answers and the time go in; requests, questions, records and events come out.
#pragma once

#include <array>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/stream/health.hpp"
#include "drivers/netbox/stream/record_queue.hpp"
#include "drivers/netbox/stream/session.hpp"

namespace kphi::netbox {

/// The box's answer when it is asked for its configuration over HTTP.
struct Answer {
  enum class Kind : std::uint8_t { unreachable, unusable, rdt_disabled, ready };
  Kind kind = Kind::unreachable;
  std::optional<Configuration> configuration;  ///< of `rdt_disabled` and `ready`
};

/// How long the box may take to answer; wall time.
inline constexpr std::chrono::seconds kAnswerTimeout{2};

/// `fetch` returns netftapi2.xml or throws.
[[nodiscard]] Answer ask_box(const std::function<std::string()>& fetch) noexcept;

/// One thread; take(), empty() and take_events() may belong to another. Times are bench time.
class Connection {
 public:
  /// `bench_speed`: bench seconds per second. The queue holds 10 s of wall time.
  explicit Connection(const Configuration& box, double bench_speed = 1);

  /// Starts the stream; counters continue, health starts again. state() tells whether it works.
  void start(Instant now);
  /// Sends the stop and delivers the records held back.
  void stop(Instant now);
  /// The box takes its present load as zero; see Session::set_bias.
  void set_bias(Instant now) { session_.set_bias(now); }

  /// Its records can be taken after deliver().
  void receive(std::span<const std::uint8_t> datagram, Instant arrival);
  /// Datagrams dropped by the socket since it was opened, as known with the next datagram.
  void note_host_drops(std::uint64_t total) noexcept { session_.note_host_drops(total); }
  /// The box's answer to the last question.
  void answered(Answer answer, Instant at);
  /// To be called at deadline(), after receive() of everything that came before.
  void advance(Instant now);

  /// Pops the next request to the box's RDT port; false if there is none.
  [[nodiscard]] bool next_request(std::array<std::uint8_t, 8>& request) noexcept {
    return session_.next_request(request);
  }
  /// True once per question: ask the box over HTTP within kAnswerTimeout, then call answered(). While one question is
  /// under way, the next one waits.
  [[nodiscard]] bool next_question() noexcept { return std::exchange(question_, false); }
  /// kNever when nothing is due.
  [[nodiscard]] Instant deadline() const noexcept;
  /// How long the receiving thread may sleep so that single records of 2 ms wall time share one wake-up; 0: wake up
  /// with the next datagram. At 7 kHz a wake-up is most of what a single record costs.
  [[nodiscard]] Duration gathering_time(Instant now) const noexcept;
  /// Lets the consumer take all that has been accepted; true if there is more than last time.
  bool deliver() noexcept {
    if (!queue_.publish()) return false;
    meter_->note_queue(queue_.waiting());
    return true;
  }

  /// Consumer: oldest first; returns how many.
  std::size_t take(std::span<LoadCellRecord> out) noexcept { return queue_.take(out); }
  /// Consumer: no record is waiting.
  [[nodiscard]] bool empty() const noexcept { return queue_.empty(); }
  /// Consumer: events since the last call, oldest first.
  [[nodiscard]] std::vector<Event> take_events();

  /// `silent` until records arrive again, also while the stream is being started again.
  [[nodiscard]] State state() const noexcept;
  [[nodiscard]] Counters counters() const noexcept;
  [[nodiscard]] StreamHealth health() const noexcept;
  /// As answered last.
  [[nodiscard]] const Configuration& configuration() const noexcept { return latest_; }
  [[nodiscard]] const StreamSettings& settings() const noexcept { return session_.settings(); }

 private:
  [[nodiscard]] StreamSettings stream_settings(const Configuration& box) const;
  void queue_accepted() noexcept;
  void collect_events() noexcept;
  void ask_about_silence(Instant silent_at) noexcept;
  void pause(Instant now) noexcept;
  void supervise(Instant now);
  void note_event(EventKind kind, Instant at, Changes changes = 0) noexcept;
  void adopt_latest();

  const double bench_speed_;
  Configuration latest_, streamed_;  // as answered last; what session_ is made for
  Session session_;
  std::optional<HealthMeter> meter_;

  /// About a silence: nothing; its question is under way; the next question or the end is due; a start is under way.
  enum class Plan : std::uint8_t { none, await_answer, pause, await_record };
  Plan plan_ = Plan::none;
  Instant due_ = kNever, give_up_at_ = kNever;
  Duration pause_{0};
  bool away_ = false;  // not ready at some time of this silence: no other client can have had its stream
  std::optional<Answer::Kind> last_answer_;  // of this silence
  bool question_ = false;

  RecordQueue queue_;
  boost::lockfree::spsc_queue<Event, boost::lockfree::capacity<256>> events_;
  std::vector<LoadCellRecord> accepted_;
  Instant newest_datagram_{0};
  std::uint64_t queue_overflows_ = 0, events_dropped_ = 0;
};

}  // namespace kphi::netbox
