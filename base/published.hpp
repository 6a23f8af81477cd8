// A plain value that one thread writes and any reads, whole, without a lock (a sequence lock). A writer that is stopped
// in the midst of it keeps no reader.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstdint>
#include <type_traits>

namespace kphi {

template <class T>
class Published {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(std::uint64_t) == 0);
  using Words = std::array<std::uint64_t, sizeof(T) / sizeof(std::uint64_t)>;

 public:
  Published() noexcept { publish(T{}); }
  /// One thread.
  void publish(const T& value) noexcept {
    const auto words = std::bit_cast<Words>(value);
    const std::uint32_t version = version_.load(std::memory_order_relaxed);
    version_.store(version + 1, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_release);
    for (std::size_t i = 0; i < words.size(); ++i) words_[i].store(words[i], std::memory_order_relaxed);
    version_.store(version + 2, std::memory_order_release);
  }
  /// Any thread. T{}, which is what it holds before the first publish(): no whole value could be had.
  [[nodiscard]] T read() const noexcept {
    Words words;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      const std::uint32_t before = version_.load(std::memory_order_acquire);
      for (std::size_t i = 0; i < words.size(); ++i) words[i] = words_[i].load(std::memory_order_relaxed);
      std::atomic_thread_fence(std::memory_order_acquire);
      if (before % 2 == 0 && version_.load(std::memory_order_relaxed) == before) return std::bit_cast<T>(words);
    }
    return T{};
  }

 private:
  static constexpr int kAttempts = 100'000;  // some milliseconds
  std::atomic<std::uint32_t> version_{0};    // odd while the words are being written
  std::array<std::atomic<std::uint64_t>, std::tuple_size_v<Words>> words_{};
};

}  // namespace kphi
