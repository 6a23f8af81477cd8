#include "drivers/netbox/stream/connection.hpp"

#include <algorithm>
#include <cmath>
#include <exception>

namespace kphi::netbox {
namespace {

constexpr double kQueueSeconds = 10;
constexpr double kQueueLimit = 1 << 23;
// Wall time. Between two questions to a box that does not stream, twice as long each time; and from the silence on.
constexpr Duration kFirstPause = std::chrono::milliseconds(250), kLongestPause = std::chrono::seconds(8);
constexpr Duration kGiveUpAfter = std::chrono::seconds(60);
// The last datagram may be a little late and is worth waiting for.
constexpr Duration kGathered = std::chrono::milliseconds(2), kMargin = std::chrono::microseconds(10);

Duration stretched(Duration wall, double bench_speed) noexcept { return from_seconds(to_seconds(wall) * bench_speed); }

std::size_t queue_capacity(const Configuration& box, double bench_speed) {
  const double records = std::ceil(kQueueSeconds * box.rdt_rate_hz * bench_speed);
  return static_cast<std::size_t>(std::clamp(records, 1024.0, kQueueLimit));
}

EventKind event_of(Answer::Kind answer) noexcept {
  constexpr EventKind kKinds[] = {EventKind::unreachable, EventKind::unusable, EventKind::rdt_disabled,
                                  EventKind::taken_over};
  return kKinds[static_cast<std::size_t>(answer)];
}

}  // namespace

Answer ask_box(const std::function<std::string()>& fetch) noexcept {
  Answer answer;
  try {
    const std::string xml = fetch();
    answer.kind = Answer::Kind::unusable;
    answer.configuration = parse_configuration(xml);
    answer.kind = answer.configuration->rdt_enabled ? Answer::Kind::ready : Answer::Kind::rdt_disabled;
  } catch (const std::exception&) {
    // `answer.kind` holds how far it came.
  }
  return answer;
}

Connection::Connection(const Configuration& box, double bench_speed)
    : bench_speed_(bench_speed),
      latest_(box),
      streamed_(box),
      session_(stream_settings(box)),
      meter_(std::in_place, box.device_rate_hz, bench_speed),
      queue_(queue_capacity(box, bench_speed)) {}

StreamSettings Connection::stream_settings(const Configuration& box) const {
  StreamSettings settings;
  settings.product = box.kind;
  settings.divisor = box.divisor;
  settings.records_per_datagram = box.records_per_datagram;
  settings.device_rate_hz = box.device_rate_hz;
  for (Duration* wall : {&settings.reply_timeout, &settings.settle, &settings.silence_timeout, &settings.bias_patience,
                         &settings.reorder_patience})
    *wall = stretched(*wall, bench_speed_);
  return settings;
}

void Connection::start(Instant now) {
  adopt_latest();
  meter_->begin();
  plan_ = Plan::none;
  session_.start(now);
}

void Connection::stop(Instant now) {
  session_.flush(accepted_);
  queue_accepted();
  if (session_.state() != State::failed) session_.stop(now);
  collect_events();
}

void Connection::receive(std::span<const std::uint8_t> datagram, Instant arrival) {
  newest_datagram_ = arrival;
  const std::span<LoadCellRecord> slots = queue_.slots(records_in(datagram.size()));
  if (session_.receive_in_order(datagram, arrival, slots)) {
    meter_->note(slots.back(), slots.size(), session_.counters().reboots);
    return queue_.fill(slots.size());
  }
  session_.receive(datagram, arrival, accepted_);
  if (!accepted_.empty()) meter_->note(accepted_.back(), accepted_.size(), session_.counters().reboots);
  queue_accepted();
}

void Connection::queue_accepted() noexcept {
  queue_overflows_ += accepted_.size() - queue_.push(accepted_);
  accepted_.clear();
}

void Connection::advance(Instant now) {
  if (session_.release_deadline() <= now) session_.release(now, accepted_);
  queue_accepted();
  session_.advance(now);
  collect_events();
  supervise(now);
}

Instant Connection::deadline() const noexcept {
  const Instant next_move = plan_ == Plan::pause ? std::min(due_, give_up_at_) : kNever;
  return std::min({session_.deadline(), session_.release_deadline(), next_move});
}

Duration Connection::gathering_time(Instant now) const noexcept {
  const Duration period = std::max(session_.settings().datagram_period(), Duration{1});
  const std::int64_t datagrams = 1 + stretched(kGathered, bench_speed_) / period;
  if (datagrams < 2) return Duration{0};
  // Counted from the newest datagram, not from now: otherwise the sleeps would drift against the stream.
  const Duration whole = datagrams * period + stretched(kMargin, bench_speed_);
  return std::clamp(newest_datagram_ + whole - now, Duration{0}, whole);
}

void Connection::note_event(EventKind kind, Instant at, Changes changes) noexcept {
  if (!events_.push(Event{.kind = kind, .at = at, .changes = changes})) ++events_dropped_;
}

void Connection::collect_events() noexcept {
  for (const Event& event : session_.take_events()) {
    if (!events_.push(event)) ++events_dropped_;
    if (event.kind == EventKind::silent) ask_about_silence(event.at);
    if (event.kind == EventKind::rebooted) question_ = true;
  }
}

void Connection::ask_about_silence(Instant silent_at) noexcept {
  plan_ = Plan::await_answer;
  question_ = true;
  pause_ = stretched(kFirstPause, bench_speed_);
  give_up_at_ = silent_at + stretched(kGiveUpAfter, bench_speed_);
  away_ = false;
  last_answer_.reset();
}

void Connection::pause(Instant now) noexcept {
  plan_ = Plan::pause;
  due_ = now + pause_;
  pause_ = std::min(2 * pause_, stretched(kLongestPause, bench_speed_));
}

void Connection::supervise(Instant now) {
  const State state = session_.state();
  if (state == State::streaming) plan_ = Plan::none;
  if (plan_ == Plan::await_record && state == State::silent) pause(now);
  if (plan_ != Plan::pause) return;
  if (now >= give_up_at_) {
    plan_ = Plan::none;
    note_event(EventKind::given_up, now);
  } else if (now >= due_) {
    plan_ = Plan::await_answer;
    question_ = true;
  }
}

void Connection::answered(Answer answer, Instant at) {
  Changes changes = 0;
  bool booted = false;
  if (answer.configuration) {
    changes = compare(latest_, *answer.configuration);
    booted = forgot_peaks(latest_, *answer.configuration);
    latest_ = std::move(*answer.configuration);
  }
  if (changes != 0) note_event(EventKind::configuration_changed, at, changes);
  if (session_.state() == State::streaming) {
    if (answer.kind == Answer::Kind::unusable) note_event(EventKind::unusable, at);
    if (!changes_stream(changes)) return;
    adopt_latest();
    return session_.start(at);
  }
  if (plan_ != Plan::await_answer) return;
  away_ = away_ || booted || answer.kind != Answer::Kind::ready;
  const bool news = std::exchange(last_answer_, answer.kind) != answer.kind;
  if (away_ && answer.kind == Answer::Kind::ready) {
    plan_ = Plan::await_record;
    adopt_latest();
    return session_.start(at);
  }
  plan_ = Plan::none;
  if (away_) pause(at);
  if (news) note_event(event_of(answer.kind), at);
}

/// The box may stream at another rate than the session was made for. Where its sample count continues, so do the
/// counters.
void Connection::adopt_latest() {
  if (!changes_stream(compare(streamed_, latest_))) return;
  session_.flush(accepted_);
  queue_accepted();
  collect_events();
  session_.adopt(stream_settings(latest_));
  meter_.emplace(latest_.device_rate_hz, bench_speed_);
  streamed_ = latest_;
}

std::vector<Event> Connection::take_events() {
  std::vector<Event> events;
  events_.consume_all([&](const Event& event) { events.push_back(event); });
  std::ranges::stable_sort(events, {}, &Event::at);
  return events;
}

State Connection::state() const noexcept { return session_.resuming() ? State::silent : session_.state(); }

Counters Connection::counters() const noexcept {
  Counters counters = session_.counters();
  counters.queue_overflows = queue_overflows_;
  return counters;
}

StreamHealth Connection::health() const noexcept {
  StreamHealth health = meter_->health();
  health.events_dropped = events_dropped_;
  return health;
}

}  // namespace kphi::netbox
