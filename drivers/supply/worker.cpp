#include "drivers/supply/worker.hpp"

#include <poll.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "base/thread.hpp"

namespace kphi::supply {
namespace {

constexpr std::chrono::milliseconds kMissedWord{5};

}  // namespace

Worker::Worker(std::unique_ptr<Supply> supply, const Clock& clock, double looks_per_second)
    : supply_(std::move(supply)),
      clock_(clock),
      period_(from_seconds(1 / looks_per_second)),
      identity_(supply_->identity()),
      thread_(start_thread({"supply", true}, [this] { run(); })) {}

Worker::~Worker() {
  stop_asked_ = true;
  ordered_.raise();
  thread_.join();
}

void Worker::switch_on() {
  ask([this, offs = offs_asked_.load()] {
    if (offs_asked_ != offs) throw DeviceError(identity_.device, "switch on", "it was switched off meanwhile");
    if (output_ && !supply_->read().output) output_.reset();  // tripped
    if (!output_) output_.emplace(*supply_);
  });
}

/// Under the lock.
DeviceError Worker::gone() const {
  return {identity_.device, "command", failure_.empty() ? "the supply is being closed" : failure_, "open it again"};
}

void Worker::ask(std::function<void()> act) {
  std::future<Answer> coming;
  {
    const std::lock_guard lock(mutex_);
    if (ended_ || stop_asked_) throw gone();
    orders_.push_back({std::move(act), {}});
    coming = orders_.back().answer.get_future();
  }
  ordered_.raise();
  const Answer answer = coming.get();
  if (answer.unfit) throw std::invalid_argument(answer.failure);
  if (!answer.failure.empty()) throw DeviceError(answer.failure);
}

std::uint64_t Worker::switch_off() noexcept {
  const std::uint64_t mine = ++offs_asked_;
  ordered_.raise();
  return mine;
}

bool Worker::switch_off_and_confirm(Duration wall) noexcept {
  const std::uint64_t mine = switch_off();
  const auto give_up = std::chrono::steady_clock::now() + wall;
  // The thread notifies without the lock, so that it never waits for this one: such a word can be missed.
  for (std::unique_lock lock(mutex_); offs_done_ < mine && !ended_ && std::chrono::steady_clock::now() < give_up;)
    changed_.wait_for(lock, kMissedWord);
  return offs_done_ >= mine;
}

std::size_t Worker::take(std::span<SupplyReading> out) { return queue_.pop(out.data(), out.size()); }

void Worker::run() noexcept {
  finish(why_failed([this] {
    next_look_ = clock_.now();
    while (serve()) {
      const Instant begun = clock_.now();
      if (begun < next_look_) continue;
      look();
      // A slow supply is left alone for as long as it took.
      const Instant done = clock_.now();
      next_look_ = std::max(next_look_ + period_, done + std::min(done - begun, period_));
    }
  }));
}

void Worker::await_order() noexcept {
  const timespec left = to_timespec(clock_.shrunk(std::max(Duration{0}, next_look_ - clock_.now())));
  pollfd order{ordered_.descriptor(), POLLIN, 0};
  if (::ppoll(&order, 1, &left, nullptr) > 0) ordered_.clear();
}

/// Waits for an order or until the next reading is due, and carries out the orders. False: the worker is to end. Throws
/// if the output was not reported off.
bool Worker::serve() {
  await_order();
  for (;;) {
    if (stop_asked_) return false;
    if (const std::uint64_t offs = offs_asked_; offs != offs_done_) {
      if (const std::string why = turn_off(); !why.empty()) throw std::runtime_error(why);
      offs_done_ = offs;
      changed_.notify_all();
    }
    std::optional<Order> order;
    {
      const std::unique_lock lock(mutex_, std::try_to_lock);  // of a caller that stands still: later
      if (lock && !orders_.empty()) {
        order.emplace(std::move(orders_.front()));
        orders_.pop_front();
      }
    }
    if (!order) return !stop_asked_;
    order->answer.set_value(answer_to(order->act));
  }
}

Worker::Answer Worker::answer_to(const std::function<void()>& act) {
  Answer answer;
  answer.failure = why_failed([&] {
    try {
      act();
    } catch (const std::invalid_argument&) {
      answer.unfit = true;
      throw;
    }
  });
  return answer;
}

/// Empty, or why the output was not reported off.
std::string Worker::turn_off() noexcept {
  if (!output_) return why_failed([this] { supply_->switch_off(); });
  std::string why = output_->off();
  output_.reset();
  return why;
}

/// An order to switch off does not wait for the rest of a reading: slow supplies take seconds for one.
void Worker::look() {
  const Instant begun = clock_.now();
  SupplyReading reading;
  try {
    reading = supply_->read([this] {
      if (stop_asked_ || offs_asked_ != offs_done_) throw Ordered{};
    });
  } catch (const Ordered&) {
    return;
  }
  longest_look_ns_ = std::max(longest_look_ns_.load(), (clock_.now() - begun).count());
  queue_.push(reading);
  newest_.publish(reading);
}

void Worker::finish(std::string why) noexcept {
  const std::string off = turn_off();
  if (why == off) why.clear();
  const std::lock_guard lock(mutex_);
  failure_ = std::move(why);
  if (off.empty()) {
    offs_done_ = offs_asked_.load();
  } else {
    failure_ += (failure_.empty() ? "" : "; ") + off + "; its output may be on: switch it off by hand";
  }
  ended_ = true;
  for (Order& order : orders_) order.answer.set_value({gone().what()});
  orders_.clear();
  changed_.notify_all();
}

}  // namespace kphi::supply
