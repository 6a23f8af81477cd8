// A session and a fake module joined in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "drivers/iq/session/session.hpp"
#include "test/drivers/iq/fake_module.hpp"

namespace kphi::iq::fake {

using namespace std::chrono_literals;
using State = Session::State;

/// A session and a module joined in virtual time, with a wire that can be told to misbehave.
class Wire {
 public:
  explicit Wire(Settings settings = {}) : module([this] { return now; }), settings_(settings), session(settings) {}

  Instant now{0};
  Module module;
  Duration latency = 2ms;                                    ///< request to reply
  std::function<void(Bytes& reply, Duration& delay)> spoil;  ///< may change or empty a reply
  std::function<void(Instant)> before_hearing;               ///< lets the module's values follow the time
  std::vector<std::pair<Instant, Bytes>> batches;            ///< all that the session sent

 private:
  Settings settings_;

 public:
  Session session;

  /// The session has promised to be quiet until its deadline: that must lie ahead.
  void run_until(Instant end) {
    flush();
    while (true) {
      const Instant next = std::min(session.deadline(), arrivals_.empty() ? kNever : arrivals_.begin()->first);
      if (next > end) break;
      now = std::max(now, next);
      if (!arrivals_.empty() && arrivals_.begin()->first <= now) {
        const Bytes bytes = arrivals_.begin()->second;
        arrivals_.erase(arrivals_.begin());
        session.receive(bytes, now);
      } else {
        session.advance(now);
        ASSERT_GT(session.deadline(), now) << "no progress";
      }
      flush();
    }
    now = end;
  }
  void run_for(Duration duration) { run_until(now + duration); }
  bool run_to_state(State state, Duration limit) {
    const Instant end = now + limit;
    while (session.state() != state && now < end) run_for(1ms);
    return session.state() == state;
  }
  void connect(Duration limit = 1s) {
    session.connect(now);
    ASSERT_TRUE(run_to_state(State::ready, limit)) << session.failure();
  }
  void expect_failure(const std::string& words, Duration limit = 1s) {
    ASSERT_TRUE(run_to_state(State::failed, limit)) << words;
    EXPECT_NE(session.failure().find(words), std::string::npos) << session.failure();
  }
  void deliver(const Bytes& bytes, Duration delay = {}) { arrivals_.emplace(now + delay, bytes); }
  [[nodiscard]] std::size_t replies_on_their_way() const { return arrivals_.size(); }
  std::vector<MotorReading> readings() {
    std::vector<MotorReading> all(10000);
    all.resize(session.take(all));
    return all;
  }
  std::vector<double> values(MotorChannel quantity) {
    std::vector<double> found;
    for (const MotorReading& reading : readings()) {
      if (reading.channel == quantity) found.push_back(reading.value);
    }
    return found;
  }
  void spin(double speed) {
    session.spin_at(RadPerSec(speed), now);
    flush();
  }
  void coast() {
    session.coast(now);
    flush();
  }

  void flush() {
    const auto output = session.output();
    if (output.empty()) return;
    batches.emplace_back(now, Bytes(output.begin(), output.end()));
    session.sent(output.size());
    if (before_hearing) before_hearing(now);
    for (Bytes& reply : module.receive(batches.back().second)) {
      Duration delay = latency;
      if (spoil) spoil(reply, delay);
      if (!reply.empty()) arrivals_.emplace(now + delay, reply);
    }
  }

 private:
  std::multimap<Instant, Bytes> arrivals_;
};

/// Connected, and what the first moments brought has been read.
struct Connected : Wire {
  explicit Connected(Duration moments = {}, const Settings& settings = {}) : Wire(settings) {
    connect();
    if (moments == Duration{}) return;
    run_for(moments);
    readings();
  }
};

inline bool is_reply(const Bytes& reply, int type, int sub) {
  return reply.size() > 4 && reply[2] == type && reply[3] == sub;
}

}  // namespace kphi::iq::fake
