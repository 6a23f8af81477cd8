#include "daq/run/console.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <iterator>
#include <mutex>
#include <utility>
#include <vector>

#include "base/descriptor.hpp"
#include "base/thread.hpp"

namespace kphi::daq {
namespace {

constexpr std::size_t kAtOnce = 512;  // bytes; a pipe with room has room for that many (POSIX's least PIPE_BUF)
constexpr int kPauseMs = 10;  // a terminal whose room is one byte, and that byte would be a new line, which takes two

/// A new descriptor of the same terminal whose write() does not block; `descriptor` itself is shared with the program's
/// parent. None if it is not a terminal.
Descriptor without_blocking(int descriptor) {
  if (::isatty(descriptor) == 0) return {};
  const std::string name = fmt::format("/proc/self/fd/{}", descriptor);
  return Descriptor(::open(name.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
}

}  // namespace

std::list<WordQueue::Text>::iterator WordQueue::first_whole() noexcept {
  return std::next(texts_.begin(), is_begun_ ? 1 : 0);
}

bool WordQueue::drop_one() noexcept {
  const auto first = first_whole();
  if (first == texts_.end()) return false;
  auto least = std::find_if(first, texts_.end(), [](const Text& text) { return text.worth != Worth::kept; });
  if (least == texts_.end()) {
    least = first;
    ++untold_;
  }
  size_ -= least->bytes.size();
  texts_.erase(least);
  return true;
}

void WordQueue::push(std::string text, Worth worth, std::uint64_t order) {
  if (text.empty()) return;
  if (worth == Worth::live && first_whole() != texts_.end() && texts_.back().worth == Worth::live) {
    size_ -= texts_.back().bytes.size();
    texts_.pop_back();
  }
  while (size_ + text.size() > kRoom && drop_one()) {
  }
  size_ += text.size();
  texts_.push_back({std::move(text), worth, order});
}

std::string_view WordQueue::begin(std::size_t most) {
  if (!is_begun_ && untold_ > 0) {
    std::string note = fmt::format("kphi: this output was blocked; messages lost here: {}\n", untold_);
    size_ += note.size();
    texts_.push_front({std::move(note), Worth::kept, order()});
    untold_ = 0;
  }
  is_begun_ = true;
  return std::string_view(texts_.front().bytes).substr(gone_, most);
}

void WordQueue::taken(std::size_t n) noexcept {
  gone_ += n;
  if (gone_ < texts_.front().bytes.size()) return;
  size_ -= texts_.front().bytes.size();
  texts_.pop_front();
  gone_ = 0;
  is_begun_ = false;
}

void WordQueue::clear() noexcept {
  texts_.clear();
  size_ = gone_ = 0;
  is_begun_ = false;
  untold_ = 0;
}

struct Console::Shared {
  struct Stream {
    explicit Stream(int named) : name(named), own(without_blocking(named)) {}
    [[nodiscard]] int descriptor() const noexcept { return own.number() < 0 ? name : own.number(); }
    const int name;
    const Descriptor own;
    WordQueue queue;
  };

  [[nodiscard]] bool is_idle() const noexcept {
    return std::ranges::all_of(streams, [](const Stream& stream) { return stream.queue.empty(); });
  }
  [[nodiscard]] Stream& stream(int name) {
    const auto known = std::ranges::find(streams, name, &Stream::name);
    return known != streams.end() ? *known : streams.emplace_back(name);
  }
  /// The bell, and each stream with waiting texts. False: the thread must end.
  [[nodiscard]] bool list(std::vector<pollfd>& waiting) {
    const std::lock_guard lock(mutex);
    waiting.assign(1, {bell.descriptor(), POLLIN, 0});
    for (const Stream& each : streams) waiting.push_back({each.queue.empty() ? -1 : each.descriptor(), POLLOUT, 0});
    return !quit;
  }
  /// The writable stream whose text has waited longest; nullptr without one.
  [[nodiscard]] Stream* choose(const std::vector<pollfd>& waited) {
    const std::lock_guard lock(mutex);
    Stream* chosen = nullptr;
    auto each = streams.begin();
    for (std::size_t i = 1; i < waited.size() && !quit; ++i, ++each) {
      if (waited[i].revents == 0) continue;
      if (chosen == nullptr || each->queue.order() < chosen->queue.order()) chosen = &*each;
    }
    return chosen;
  }
  void write_some(Stream& to) {
    std::string_view bytes;
    {
      const std::lock_guard lock(mutex);
      bytes = to.queue.begin(kAtOnce);
    }
    const ssize_t n = ::write(to.descriptor(), bytes.data(), bytes.size());
    const bool has_no_room = n < 0 && errno == EAGAIN;
    {
      const std::lock_guard lock(mutex);
      if (n > 0) to.queue.taken(static_cast<std::size_t>(n));
      if (n < 0 && !has_no_room) to.queue.clear();
      if (is_idle()) changed.notify_all();
    }
    if (has_no_room) ::poll(nullptr, 0, kPauseMs);
  }

  Wakeup bell;
  mutable std::mutex mutex;
  std::condition_variable changed;
  std::list<Stream> streams;
  std::uint64_t order = 0;  ///< of the newest text of all
  bool quit = false, ended = false, has_thread = false;
};

Console::Console() : shared_(std::make_shared<Shared>()) {}

Console::~Console() {
  std::unique_lock lock(shared_->mutex);
  if (!shared_->has_thread) return;
  shared_->quit = true;
  shared_->bell.raise();
  shared_->changed.wait_for(lock, kGiveUp, [this] { return shared_->ended; });
}

void Console::put(int descriptor, std::string text, Worth worth) noexcept {
  try {
    const std::lock_guard lock(shared_->mutex);
    if (!shared_->has_thread) {
      // Without signals, SIGTTOU does not stop a program in the background either.
      start_thread({"console"}, [shared = shared_] { write_on(shared); }).detach();
      shared_->has_thread = true;
    }
    shared_->stream(descriptor).queue.push(std::move(text), worth, ++shared_->order);
  } catch (...) {
    // No memory, or no thread: a run is worth more than its messages.
  }
  shared_->bell.raise();
}

bool Console::finish(std::chrono::milliseconds limit) noexcept {
  std::unique_lock lock(shared_->mutex);
  return shared_->changed.wait_for(lock, limit, [this] { return shared_->is_idle(); });
}

bool Console::is_used() const noexcept {
  const std::lock_guard lock(shared_->mutex);
  return shared_->order > 0;
}

void Console::write_on(const std::shared_ptr<Shared>& shared) noexcept {
  try {
    for (std::vector<pollfd> waiting; shared->list(waiting);) {
      if (::poll(waiting.data(), waiting.size(), -1) <= 0) continue;
      shared->bell.clear();
      if (Shared::Stream* chosen = shared->choose(waiting)) shared->write_some(*chosen);
    }
  } catch (const std::bad_alloc&) {
    // Nothing is written any more; finish() ends at its limit.
  }
  const std::lock_guard lock(shared->mutex);
  shared->ended = true;
  shared->changed.notify_all();
}

Console& console() noexcept {
  static Console* const the_programs = new Console;  // NOLINT(bugprone-unhandled-exception-at-new)
  return *the_programs;
}

void put(std::FILE* stream, const std::string& text, Worth worth) noexcept {
  if (stream == stdout || stream == stderr) return console().put(fileno(stream), text, worth);
  (void)std::fputs(text.c_str(), stream);
  (void)std::fflush(stream);
}

}  // namespace kphi::daq
