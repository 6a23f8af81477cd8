#include "daq/live/live_session.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "daq/live/access_control.hpp"

namespace kphi::daq::live {

StepFigures QuickLook::result() const {
  const auto n = static_cast<Eigen::Index>(thrusts_n_.size());
  if (n == 0) return {};
  const Eigen::Map<const Eigen::ArrayXd> thrust(thrusts_n_.data(), n), squared(speeds_squared_.data(), n);
  const auto k_of = [&](Eigen::Index begin, Eigen::Index end) {
    return thrust.segment(begin, end - begin).mean() / squared.segment(begin, end - begin).mean();
  };
  StepFigures result{thrusts_n_.size(), thrust.mean(), std::sqrt(squared.mean()), k_of(0, n), kUnknown};
  if (n < Eigen::Index{2} * kBlocks) return result;
  // Means of successive blocks: what is correlated within a block counts once.
  Eigen::Array<double, kBlocks, 1> blocks;
  for (Eigen::Index i = 0; i < kBlocks; ++i) blocks[i] = k_of(i * n / kBlocks, (i + 1) * n / kBlocks);
  result.u_k = std::sqrt((blocks - result.k).square().sum() / (kBlocks * (kBlocks - 1)));
  return result;
}

void LiveProgress::add_to_step(const Position& position, const Observation& seen, Instant now) {
  if (position.step != step_) {
    step_ = position.step;
    step_began_ = now;
    quick_look_.begin();
  }
  const bool is_settled = step_ >= 0 && now - step_began_ >= from_seconds(subject_.minimum_discard.value());
  if (is_settled && seen.motor_is_fresh() && seen.load_cell_is_fresh()) quick_look_.add(seen.thrust(), seen.speed());
}

void LiveProgress::guarded(const std::vector<GuardLimit>& limits) {
  inner_.guarded(limits);
  feed_.tell(limits_message(limits));
  if (plotter_ != nullptr) plotter_->hold_to(limits);
}

void LiveProgress::tick(const Position& position, const Observation& seen) {
  inner_.tick(position, seen);
  const Instant now = clock_.now();
  add_to_step(position, seen, now);
  const std::chrono::duration<double> epoch = clock_.epoch_utc().time_since_epoch();
  const Tick tick{to_seconds(now), epoch.count() + to_seconds(clock_.shrunk(now)), position, seen};
  feed_.show(tick);
  if (plotter_ != nullptr) plotter_->send(tick);
}

void LiveProgress::step_done(const Position& position, const Observation& seen) {
  inner_.step_done(position, seen);
  if (position.step < 0) return;
  const StepFigures result = quick_look_.result();
  if (result.n > 0) feed_.tell(step_message(position, result));
}

void LiveProgress::say(const std::string& line) {
  inner_.say(line);
  feed_.tell(line_message(to_seconds(clock_.now()), line));
}

void LiveProgress::reached(const std::string& words) {
  inner_.reached(words);
  feed_.tell(reached_message(words));
}

void LiveProgress::asks(const StandQuestion& question) {
  inner_.asks(question);
  feed_.tell(ask_message(question));
}

LiveSession::LiveSession(const LiveOptions& options, Subject subject) : subject_(std::move(subject)) {
  if (!options.udp_json.empty()) plotter_ = std::make_unique<UdpJson>(options.udp_json, subject_.limits);
  if (!options.port) return;
  Server::Settings settings;
  settings.port = *options.port;
  settings.token = new_token();
  settings.page = page_text();
  settings.hello = hello_message(subject_);
  settings.can_stop = !subject_.replay;
  settings.can_steer = subject_.by_hand || subject_.weighs;
  server_ = std::make_unique<Server>(std::move(settings), feed_);
}

std::unique_ptr<Progress> LiveSession::beside(Progress& behind, const Clock& clock) {
  clock_ = &clock;
  return std::make_unique<LiveProgress>(behind, feed_, plotter_.get(), subject_, clock);
}

void LiveSession::end(bool well, bool at_rest, const std::string& words) {
  feed_.tell(end_message(clock_ != nullptr ? to_seconds(clock_->now()) : 0, well, at_rest, words));
}

}  // namespace kphi::daq::live
