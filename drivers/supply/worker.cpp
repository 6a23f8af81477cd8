#include "drivers/supply/worker.hpp"

#include <stdexcept>
#include <utility>

#include "base/error.hpp"
#include "base/thread.hpp"

namespace kphi::supply {
namespace {

Duration period_of(double looks_per_second) {
  if (!(looks_per_second >= 0.1 && looks_per_second <= 100)) {
    throw std::invalid_argument("a supply can be read 0.1 to 100 times per second");
  }
  return from_seconds(1 / looks_per_second);
}

std::string words_of(const std::exception_ptr& exception) {
  try {
    std::rethrow_exception(exception);
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "an unknown failure";
  }
}

}  // namespace

Worker::Worker(std::unique_ptr<Supply> supply, const Clock& clock, double looks_per_second)
    : supply_(std::move(supply)),
      clock_(clock),
      period_(period_of(looks_per_second)),
      identity_(supply_->identity()),
      thread_(start_thread([this] { run(); })) {}

Worker::~Worker() {
  {
    const std::lock_guard lock(mutex_);
    stop_asked_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

Limits Worker::apply(const Limits& limits) {
  Limits applied;
  ask([&] { applied = supply_->apply(limits); });
  return applied;
}

void Worker::switch_on() {
  std::uint64_t offs = 0;
  {
    const std::lock_guard lock(mutex_);
    offs = offs_asked_;
  }
  ask([this, offs] {
    {
      const std::lock_guard lock(mutex_);
      if (offs_asked_ != offs) throw DeviceError(identity_.device, "switch on", "it was switched off meanwhile");
    }
    if (output_ && !supply_->read().output) output_.reset();  // tripped
    if (!output_) output_.emplace(*supply_);
  });
}

void Worker::ask(std::function<void()> act) {
  std::future<Answer> coming;
  {
    const std::lock_guard lock(mutex_);
    if (ended_ || stop_asked_) {
      throw DeviceError(identity_.device, "command", failure_.empty() ? "the supply is being closed" : failure_,
                        "open it again");
    }
    orders_.push_back({std::move(act), {}});
    coming = orders_.back().answer.get_future();
  }
  changed_.notify_all();
  const Answer answer = coming.get();
  if (answer.kind == Answer::Kind::unfit) throw std::invalid_argument(answer.words);
  if (answer.kind == Answer::Kind::failed) throw DeviceError(answer.words);
}

std::uint64_t Worker::ask_off() noexcept {
  std::uint64_t mine = 0;
  {
    const std::lock_guard lock(mutex_);
    mine = ++offs_asked_;
  }
  changed_.notify_all();
  return mine;
}

void Worker::switch_off() noexcept { ask_off(); }

bool Worker::switch_off_and_confirm(Duration wall) noexcept {
  const std::uint64_t mine = ask_off();
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, wall, [&] { return offs_done_ >= mine || ended_; });
  return offs_done_ >= mine;
}

std::size_t Worker::take(std::span<Reading> out) { return queue_.pop(out.data(), out.size()); }

std::optional<Reading> Worker::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

Counters Worker::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

std::uint64_t Worker::dropped_readings() const {
  const std::lock_guard lock(mutex_);
  return dropped_readings_;
}

bool Worker::alive() const {
  const std::lock_guard lock(mutex_);
  return !ended_;
}

std::string Worker::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

void Worker::run() noexcept {
  std::string why;
  try {
    next_look_ = clock_.now();
    while (serve()) {
      if (clock_.now() < next_look_) continue;
      look();
      next_look_ = std::max(next_look_ + period_, clock_.now());
    }
  } catch (...) {
    why = words_of(std::current_exception());
  }
  finish(std::move(why));
}

/// Waits for an order or until the next reading is due, and carries out the orders. False: the worker is to end.
bool Worker::serve() {
  std::unique_lock lock(mutex_);
  const auto asked = [&] { return stop_asked_ || !orders_.empty() || offs_asked_ != offs_done_; };
  changed_.wait_for(lock, clock_.shrunk(std::max(Duration{0}, next_look_ - clock_.now())), asked);
  if (stop_asked_) return false;
  if (offs_asked_ != offs_done_) {
    lock.unlock();
    apply_off();
    lock.lock();
  }
  while (!orders_.empty()) {
    Order order = std::move(orders_.front());
    orders_.pop_front();
    lock.unlock();
    order.answer.set_value(answer_to(order.act));
    lock.lock();
  }
  return !stop_asked_;
}

Worker::Answer Worker::answer_to(const std::function<void()>& act) {
  try {
    act();
    return {};
  } catch (const std::invalid_argument& unfit) {
    return {Answer::Kind::unfit, unfit.what()};
  } catch (...) {
    return {Answer::Kind::failed, words_of(std::current_exception())};
  }
}

/// Throws if the output was not reported off.
void Worker::apply_off() {
  std::uint64_t asked = 0;
  {
    const std::lock_guard lock(mutex_);
    asked = offs_asked_;
  }
  if (const std::string why = turn_off(); !why.empty()) throw std::runtime_error(why);
  const std::lock_guard lock(mutex_);
  offs_done_ = asked;
  changed_.notify_all();
}

/// Empty, or why the output was not reported off.
std::string Worker::turn_off() noexcept {
  if (output_) {
    std::string why = output_->off();
    output_.reset();
    return why;
  }
  try {
    supply_->switch_off();
    return {};
  } catch (...) {
    return words_of(std::current_exception());
  }
}

void Worker::look() {
  const Reading reading = supply_->read();
  const bool kept = queue_.push(reading);
  const std::lock_guard lock(mutex_);
  newest_ = reading;
  counters_ = supply_->counters();
  if (!kept) ++dropped_readings_;
}

void Worker::finish(std::string why) noexcept {
  const std::string off = turn_off();
  if (why == off) why.clear();
  const std::lock_guard lock(mutex_);
  failure_ = std::move(why);
  if (off.empty()) {
    offs_done_ = offs_asked_;
  } else {
    failure_ += (failure_.empty() ? "" : "; ") + off + "; its output may be on: switch it off by hand";
  }
  counters_ = supply_->counters();
  ended_ = true;
  const DeviceError gone(identity_.device, "command", failure_.empty() ? "the supply is being closed" : failure_,
                         "open it again");
  for (Order& order : orders_) order.answer.set_value({Answer::Kind::failed, gone.what()});
  orders_.clear();
  changed_.notify_all();
}

}  // namespace kphi::supply
