#include "drivers/netbox/receive/load_cell.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>

#include "base/error.hpp"
#include "drivers/netbox/configuration/http.hpp"
#include "drivers/netbox/receive/audit.hpp"

namespace kphi::netbox {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::nanoseconds kHttpTimeout = 5s;
constexpr std::chrono::nanoseconds kHealthPeriod = 20ms;
constexpr std::chrono::nanoseconds kLongestLinger = 100ms;
constexpr int kBatchesPerDrain = 64;
constexpr double kQueueSeconds = 10;
constexpr double kQueueLimit = 1 << 23;

Configuration read_configuration(const Address& address) {
  return parse_configuration(http_get(address.host, address.http_port, "/netftapi2.xml", kHttpTimeout),
                             "Net Box " + address.host);
}

StreamPolicy on_the_bench(const StreamPolicy& policy, const Clock& clock) {
  return {policy.reconnect,
          clock.stretched(policy.first_pause),
          clock.stretched(policy.longest_pause),
          clock.stretched(policy.give_up_after),
          clock.stretched(policy.lease),
          policy.hand_over};
}

StreamSettings stream_settings(const Configuration& configuration, const Clock& clock, Command mode, Duration lease) {
  StreamSettings settings;
  settings.product = configuration.kind;
  settings.lease = lease;
  settings.buffered = mode == Command::buffered;
  settings.multi_unit = mode == Command::multi_unit;
  settings.divisor = configuration.divisor;
  settings.records_per_datagram = configuration.records_per_datagram;
  settings.device_rate_hz = configuration.device_rate_hz;
  settings.reply_timeout = clock.stretched(settings.reply_timeout);
  settings.settle = clock.stretched(settings.settle);
  settings.silence_timeout = clock.stretched(settings.silence_timeout);
  settings.bias_patience = clock.stretched(settings.bias_patience);
  settings.reorder_patience = clock.stretched(settings.reorder_patience);
  return settings;
}

int records_of(const Configuration& configuration, Command mode) noexcept {
  return mode == Command::buffered ? configuration.records_per_datagram : 1;
}

double bench_seconds_per_second(const Clock& clock) noexcept { return to_seconds(clock.stretched(1s)); }

double wall_rate_hz(const Configuration& configuration, const Clock& clock) noexcept {
  return configuration.rdt_rate_hz * bench_seconds_per_second(clock);
}

std::size_t queue_capacity(const Configuration& configuration, const Clock& clock) {
  const double records = std::ceil(kQueueSeconds * wall_rate_hz(configuration, clock));
  return static_cast<std::size_t>(std::clamp(records, 1024.0, kQueueLimit));
}

Duration between(const timespec& from, const timespec& to) noexcept {
  return Duration((to.tv_sec - from.tv_sec) * 1'000'000'000 + to.tv_nsec - from.tv_nsec);
}

/// True when `descriptor` became readable within `wall`.
bool poll_for(std::span<pollfd> descriptors, std::chrono::nanoseconds wall) noexcept {
  const auto clamped = std::clamp<std::chrono::nanoseconds>(wall, 0ns, 1h);
  const timespec timeout{clamped.count() / 1'000'000'000, clamped.count() % 1'000'000'000};
  return ppoll(descriptors.data(), descriptors.size(), &timeout, nullptr) > 0;
}

}  // namespace

LoadCell::LoadCell(const Address& address, const Clock& clock, Command mode, const StreamPolicy& policy)
    : address_(address),
      clock_(clock),
      configuration_(read_configuration(address)),
      mode_(mode),
      policy_(on_the_bench(policy, clock)),
      socket_(address.host, address.rdt_port),
      ring_(queue_capacity(configuration_, clock)),
      inquiry_(address, clock, configuration_, order_wakeup_),
      session_(stream_settings(configuration_, clock, mode, policy_.lease)),
      gathering_(policy.hand_over, session_.settings().datagram_period(), bench_seconds_per_second(clock)),
      meter_(configuration_.device_rate_hz),
      reconnect_(policy_),
      streamed_(configuration_) {
  if (mode == Command::multi_unit && configuration_.kind == Product::axia) {
    throw DeviceError("Net Box " + address.host, "prepare the stream", "an Ethernet Axia knows no multi-unit mode",
                      "use real-time or buffered mode");
  }
  accepted_.reserve(UdpSocket::kBatch * kMaxRecords);
}

LoadCell::~LoadCell() { stop(); }

void LoadCell::start() {
  stop();
  if (!configuration_.rdt_enabled) {
    throw DeviceError("Net Box " + address_.host, "start the stream", "RDT is disabled (comrdte)",
                      "enable RDT on the box's Communications page");
  }
  stopping_ = false;
  order_wakeup_.clear();
  state_ = State::starting;
  thread_ = std::thread([this] { run(); });
  // The session ends this by itself: it either streams or gives up.
  state_.wait(State::starting);
  if (state_ != State::failed) return;
  stop();
  throw_unanswered();
}

void LoadCell::stop() noexcept {
  if (!thread_.joinable()) return;
  stopping_ = true;
  order_wakeup_.raise();
  thread_.join();
}

void LoadCell::set_bias() noexcept {
  bias_asked_ = true;
  order_wakeup_.raise();
}

void LoadCell::reset_latch() noexcept {
  latch_reset_asked_ = true;
  order_wakeup_.raise();
}

std::size_t LoadCell::take(std::span<StampedRecord> out) noexcept { return ring_.take(out); }

bool LoadCell::wait(std::chrono::nanoseconds wall) noexcept {
  records_wanted_.store(true, std::memory_order_relaxed);
  if (!ring_.empty()) return true;
  const auto deadline = std::chrono::steady_clock::now() + wall;
  for (auto left = wall; left > 0ns; left = deadline - std::chrono::steady_clock::now()) {
    consumer_bell_.listen();
    if (ring_.empty()) consumer_bell_.sleep(left);
    if (ring_.empty()) continue;
    consumer_bell_.leave();
    return true;
  }
  consumer_bell_.leave();
  return false;
}

std::vector<Event> LoadCell::take_events() {
  std::vector<Event> events;
  events_.consume_all([&](const Event& event) { events.push_back(event); });
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.at < b.at; });
  return events;
}

std::string LoadCell::receive_buffer_note() const {
  const StreamSettings& settings = session_.settings();
  const std::size_t payload = kRecordBytes * (settings.buffered ? settings.records_per_datagram : 1);
  return tolerated_stall(socket_.receive_buffer_bytes(), payload, clock_.shrunk(settings.datagram_period()));
}

std::optional<Finding> LoadCell::receive_buffer_finding() const {
  return small_receive_buffer(socket_.receive_buffer_bytes(), records_of(configuration_, mode_),
                              configuration_.rdt_rate_hz, bench_seconds_per_second(clock_));
}

void LoadCell::run() noexcept {
  // Signals are the main thread's business.
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
  // Else the kernel may make each sleep_time longer by 50 us.
  prctl(PR_SET_TIMERSLACK, 1);
  adopt_latest_stream();
  meter_.begin();
  reconnect_.streaming();
  bias_asked_ = latch_reset_asked_ = false;
  session_.start(clock_.now());
  while (!stopping_ && session_.state() != State::failed) pump();
  const bool failed = session_.state() == State::failed;
  if (!failed) session_.stop(clock_.now());
  send_requests();
  session_.flush(accepted_);
  store_accepted();
  hand_over();
  linger();
  publish();
  publish_health();
  hand_over_events();
}

void LoadCell::pump() noexcept {
  if (bias_asked_.exchange(false)) session_.set_bias(clock_.now());
  if (latch_reset_asked_.exchange(false)) session_.reset_latch();
  if (stopping_) return;
  send_requests();
  wait_for_datagrams();
  drain();
  const Instant now = clock_.now();
  if (session_.release_deadline() <= now) {
    session_.release(now, accepted_);
    store_accepted();
    hand_over();
  }
  session_.advance(now);
  publish();
  if (now >= health_due_) {
    publish_health();
    health_due_ = now + clock_.stretched(kHealthPeriod);
  }
  hand_over_events();
  supervise(now);
}

void LoadCell::wait_for_datagrams() noexcept {
  if (const auto wall = clock_.shrunk(sleep_time()); wall > 0ns) return std::this_thread::sleep_for(wall);
  std::array<pollfd, 2> both{{{order_wakeup_.descriptor(), POLLIN, 0}, {socket_.native_handle(), POLLIN, 0}}};
  const Instant due = std::min({session_.deadline(), session_.release_deadline(), reconnect_.deadline()});
  poll_for(both, due == kNever ? 1h : clock_.shrunk(due - clock_.now()));
  if (both[0].revents != 0) order_wakeup_.clear();
}

/// None without datagrams, so that silence and orders are noticed by poll, nor where a datagram is to be answered.
Duration LoadCell::sleep_time() const noexcept {
  if (drained_ == 0 || session_.state() != State::streaming) return Duration{0};
  const Duration sleep_time = gathering_.sleep_time(clock_.now(), awaited_);
  return session_.renews_within(sleep_time) ? Duration{0} : sleep_time;
}

void LoadCell::drain() noexcept {
  drained_ = 0;
  for (int batch = 0; batch < kBatchesPerDrain; ++batch) {
    const std::span<const UdpSocket::Datagram> datagrams = socket_.receive();
    if (datagrams.empty()) break;
    // The clock is read once for all.
    const timespec& first = datagrams.front().stamp;
    const bool stamped = first.tv_sec != 0;
    const Instant at_first = stamped ? clock_.at_realtime(first) : clock_.now();
    for (const UdpSocket::Datagram& datagram : datagrams)
      ingest(datagram, stamped ? at_first + clock_.stretched(between(first, datagram.stamp)) : at_first);
    drained_ += datagrams.size();
    if (datagrams.size() < UdpSocket::kBatch) break;
  }
  hand_over();
}

void LoadCell::ingest(const UdpSocket::Datagram& datagram, Instant arrival) noexcept {
  gathering_.note(arrival);
  session_.note_host_drops(datagram.dropped);
  const std::span<StampedRecord> room = ring_.room(records_in(datagram.bytes.size()));
  const std::size_t count = session_.receive_in_order(datagram.bytes, arrival, room);
  if (count > 0) {
    meter_.note(room[count - 1], count, session_.counters().reboots);
    ring_.fill(count);
    newest_arrival_ = arrival;
    return;
  }
  session_.receive(datagram.bytes, arrival, accepted_);
  if (!accepted_.empty()) meter_.note(accepted_.back(), accepted_.size(), session_.counters().reboots);
  store_accepted();
}

void LoadCell::store_accepted() noexcept {
  if (accepted_.empty()) return;
  queue_overflows_ += accepted_.size() - ring_.push(accepted_);
  newest_arrival_ = accepted_.back().arrival;
  accepted_.clear();
}

void LoadCell::hand_over() noexcept {
  newest_arrival_ns_.store(newest_arrival_.count(), std::memory_order_release);
  if (!ring_.publish()) return;
  meter_.note_queue(ring_.waiting());
  awaited_ = consumer_bell_.listening() || records_wanted_.load(std::memory_order_relaxed);
  records_wanted_.store(false, std::memory_order_relaxed);
  consumer_bell_.ring();
}

void LoadCell::send_requests() noexcept {
  std::array<std::uint8_t, 8> request;
  while (session_.next_request(request)) socket_.send(request);
}

void LoadCell::hand_over_events() noexcept {
  session_.events().drain([this](const Event& event) {
    events_.push(event);
    if (event.kind == EventKind::silent) reconnect_.silent(event.at);
    if (event.kind == EventKind::rebooted) inquiry_.ask();
  });
}

void LoadCell::supervise(Instant now) noexcept {
  Inquiry::Answer answer;
  while (inquiry_.take(answer)) {
    order_wakeup_.clear();
    note_answer(answer);
  }
  if (session_.state() == State::streaming) {
    reconnect_.streaming();
  } else if (reconnect_.starting() && session_.state() == State::silent) {
    reconnect_.start_failed(now);
  }
  switch (reconnect_.next(now)) {
    case Reconnect::Move::ask:
      return inquiry_.ask();
    case Reconnect::Move::start:
      adopt_latest_stream();
      return session_.start(now);
    case Reconnect::Move::give_up:
      events_.push(Event{.kind = EventKind::given_up, .at = now});
      return;
    case Reconnect::Move::none:
      return;
  }
}

void LoadCell::note_answer(const Inquiry::Answer& answer) noexcept {
  constexpr EventKind kKinds[] = {EventKind::unreachable, EventKind::unusable, EventKind::rdt_disabled,
                                  EventKind::taken_over};
  if (answer.changes != 0)
    events_.push(Event{.kind = EventKind::configuration_changed, .at = answer.at, .changes = answer.changes});
  const bool streams = session_.state() == State::streaming;
  if (streams) {
    if (answer.box == BoxAnswer::unusable) events_.push(Event{.kind = EventKind::unusable, .at = answer.at});
    if (!changes_stream(answer.changes)) return;
    adopt_latest_stream();
    session_.start(answer.at);
    return;
  }
  if (!reconnect_.answered(answer.box, answer.booted, answer.at)) return;
  const bool starts = answer.box == BoxAnswer::ready && reconnect_.will_start();
  if (!starts) events_.push(Event{.kind = kKinds[static_cast<std::size_t>(answer.box)], .at = answer.at});
}

/// The box may be set to another rate than when session_ was made. Where the count of its samples goes on, the account
/// does.
void LoadCell::adopt_latest_stream() {
  Configuration latest = inquiry_.latest();
  if (!changes_stream(compare(streamed_, latest))) return;
  session_.flush(accepted_);
  store_accepted();
  hand_over();
  Session fresh(stream_settings(latest, clock_, mode_, policy_.lease), session_);
  std::destroy_at(&session_);
  std::construct_at(&session_, std::move(fresh));
  gathering_ = Batching(policy_.hand_over, session_.settings().datagram_period(), bench_seconds_per_second(clock_));
  std::destroy_at(&meter_);
  std::construct_at(&meter_, latest.device_rate_hz);
  streamed_ = std::move(latest);
}

State LoadCell::shown_state() const noexcept { return session_.resuming() ? State::silent : session_.state(); }

void LoadCell::linger() noexcept {
  const Instant give_up = clock_.now() + clock_.stretched(kLongestLinger);
  pollfd readable{socket_.native_handle(), POLLIN, 0};
  while (clock_.now() < give_up && poll_for({&readable, 1}, 2 * clock_.shrunk(session_.settings().settle))) {
    drain();
    send_requests();
  }
}

void LoadCell::publish() noexcept {
  Counters counters = session_.counters();
  counters.queue_overflows = queue_overflows_;
  counters_.publish(counters);
  const State state = shown_state();
  if (state_ == state) return;
  state_ = state;
  state_.notify_all();
}

void LoadCell::publish_health() noexcept {
  Health health = meter_.health();
  health.events_dropped = session_.events().dropped();
  health_.publish(health);
}

void LoadCell::throw_unanswered() const {
  const std::string device = fmt::format("Net Box {}:{}", address_.host, address_.rdt_port);
  if (socket_.refusals() > 0) {
    throw DeviceError(device, "start the stream", "the box is reachable, but refuses the RDT port",
                      "check rdt_port, and that RDT is enabled on the box's Communications page");
  }
  if (socket_.last_error() != 0) {
    throw DeviceError(device, "start the stream", std::strerror(socket_.last_error()),
                      "check this host's network settings");
  }
  throw DeviceError(device, "start the stream",
                    fmt::format("no record after {} requests", session_.settings().attempts),
                    "check that no firewall holds back UDP and that no other program uses the box");
}

}  // namespace kphi::netbox
