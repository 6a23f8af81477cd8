#include "drivers/netbox/stream/connection.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

namespace kphi::netbox {
namespace {

constexpr double kQueueSeconds = 10;
constexpr double kQueueLimit = 1 << 23;
// The last datagram may be a little late and is worth waiting for.
constexpr Duration kGathered = std::chrono::milliseconds(2), kMargin = std::chrono::microseconds(10);

Duration stretched(Duration wall, double bench_speed) noexcept { return from_seconds(to_seconds(wall) * bench_speed); }

StreamPolicy in_bench_time(const StreamPolicy& policy, double bench_speed) noexcept {
  return {policy.reconnect, stretched(policy.first_pause, bench_speed), stretched(policy.longest_pause, bench_speed),
          stretched(policy.give_up_after, bench_speed)};
}

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

void Reconnect::silent(Instant now) noexcept {
  phase_ = Phase::to_ask;
  pause_ = policy_.first_pause;
  give_up_at_ = now + policy_.give_up_after;
  away_ = false;
  answer_.reset();
}

bool Reconnect::answered(Answer::Kind answer, bool booted, Instant now) noexcept {
  if (phase_ != Phase::asking) return false;
  const bool news = answer_ != answer;
  answer_ = answer;
  away_ = away_ || booted || answer != Answer::Kind::ready;
  if (!policy_.reconnect || !away_) {
    phase_ = Phase::resting;
  } else if (answer == Answer::Kind::ready) {
    phase_ = Phase::to_start;
  } else {
    pause(now);
  }
  return news;
}

void Reconnect::start_failed(Instant now) noexcept { pause(now); }

void Reconnect::pause(Instant now) noexcept {
  phase_ = Phase::pausing;
  due_ = now + pause_;
  pause_ = std::min(2 * pause_, policy_.longest_pause);
}

Reconnect::Move Reconnect::next(Instant now) noexcept {
  switch (phase_) {
    case Phase::to_ask:
      phase_ = Phase::asking;
      return Move::ask;
    case Phase::to_start:
      phase_ = Phase::starting;
      return Move::start;
    case Phase::pausing:
      if (now >= give_up_at_) {
        phase_ = Phase::resting;
        return Move::give_up;
      }
      if (now < due_) return Move::none;
      phase_ = Phase::asking;
      return Move::ask;
    case Phase::resting:
    case Phase::asking:
    case Phase::starting:
      break;
  }
  return Move::none;
}

Instant Reconnect::deadline() const noexcept { return phase_ == Phase::pausing ? std::min(due_, give_up_at_) : kNever; }

Connection::Connection(const Configuration& box, const StreamPolicy& policy, double bench_speed)
    : bench_speed_(bench_speed),
      latest_(box),
      streamed_(box),
      session_(stream_settings(box)),
      meter_(box.device_rate_hz),
      reconnect_(in_bench_time(policy, bench_speed)),
      ring_(queue_capacity(box, bench_speed)) {}

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
  reconnect_.streaming();
  session_->start(now);
}

void Connection::stop(Instant now) {
  session_->flush(accepted_);
  store_accepted();
  if (session_->state() != State::failed) session_->stop(now);
  collect_events();
}

void Connection::receive(std::span<const std::uint8_t> datagram, Instant arrival) {
  newest_datagram_ = arrival;
  const std::span<StampedRecord> room = ring_.room(records_in(datagram.size()));
  const std::size_t count = session_->receive_in_order(datagram, arrival, room);
  if (count > 0) {
    meter_->note(room[count - 1], count, session_->counters().reboots);
    ring_.fill(count);
    newest_arrival_ = arrival;
    return;
  }
  session_->receive(datagram, arrival, accepted_);
  if (!accepted_.empty()) meter_->note(accepted_.back(), accepted_.size(), session_->counters().reboots);
  store_accepted();
}

void Connection::store_accepted() noexcept {
  if (accepted_.empty()) return;
  queue_overflows_ += accepted_.size() - ring_.push(accepted_);
  newest_arrival_ = accepted_.back().arrival;
  accepted_.clear();
}

bool Connection::publish() noexcept {
  if (!ring_.publish()) return false;
  meter_->note_queue(ring_.waiting());
  return true;
}

void Connection::advance(Instant now) {
  if (session_->release_deadline() <= now) {
    session_->release(now, accepted_);
    store_accepted();
  }
  session_->advance(now);
  collect_events();
  supervise(now);
}

Instant Connection::deadline() const noexcept {
  return std::min({session_->deadline(), session_->release_deadline(), reconnect_.deadline()});
}

Duration Connection::gathering_time(Instant now) const noexcept {
  const Duration period = std::max(session_->settings().datagram_period(), Duration{1});
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
  session_->events().drain([this](const Event& event) {
    if (!events_.push(event)) ++events_dropped_;
    if (event.kind == EventKind::silent) reconnect_.silent(event.at);
    if (event.kind == EventKind::rebooted) question_ = true;
  });
}

void Connection::supervise(Instant now) {
  if (session_->state() == State::streaming) {
    reconnect_.streaming();
  } else if (reconnect_.starting() && session_->state() == State::silent) {
    reconnect_.start_failed(now);
  }
  switch (reconnect_.next(now)) {
    case Reconnect::Move::ask:
      question_ = true;
      return;
    case Reconnect::Move::start:
      adopt_latest();
      return session_->start(now);
    case Reconnect::Move::give_up:
      note_event(EventKind::given_up, now);
      return;
    case Reconnect::Move::none:
      return;
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
  if (session_->state() == State::streaming) {
    if (answer.kind == Answer::Kind::unusable) note_event(EventKind::unusable, at);
    if (!changes_stream(changes)) return;
    adopt_latest();
    return session_->start(at);
  }
  if (!reconnect_.answered(answer.kind, booted, at)) return;
  const bool starts = answer.kind == Answer::Kind::ready && reconnect_.will_start();
  if (!starts) note_event(event_of(answer.kind), at);
}

/// The box may stream at another rate than the session was made for. Where its sample count continues, so do the
/// counters.
void Connection::adopt_latest() {
  if (!changes_stream(compare(streamed_, latest_))) return;
  session_->flush(accepted_);
  store_accepted();
  collect_events();
  Session fresh(stream_settings(latest_), *session_);
  session_.emplace(std::move(fresh));
  meter_.emplace(latest_.device_rate_hz);
  streamed_ = latest_;
}

std::vector<Event> Connection::take_events() {
  std::vector<Event> events;
  events_.consume_all([&](const Event& event) { events.push_back(event); });
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.at < b.at; });
  return events;
}

State Connection::state() const noexcept { return session_->resuming() ? State::silent : session_->state(); }

Counters Connection::counters() const noexcept {
  Counters counters = session_->counters();
  counters.queue_overflows = queue_overflows_;
  return counters;
}

Health Connection::health() const noexcept {
  Health health = meter_->health();
  health.events_dropped = session_->dropped_events() + events_dropped_;
  return health;
}

}  // namespace kphi::netbox
