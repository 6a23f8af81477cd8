// Texts that wait for one stream, in their order, bounded: when there is no room the ones that matter least go. One
// thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <string>
#include <string_view>

namespace kphi::daq {

/// What a text is worth when there is no room for all.
enum class Worth : std::uint8_t {
  kept,     ///< dropped last, and counted
  passing,  ///< dropped first, the oldest before the others
  live,     ///< as passing; also takes the place of a live text right before it that has not begun to leave
};

class WordQueue {
 public:
  static constexpr std::size_t kRoom = 256 * 1024;  ///< bytes

  /// A text longer than kRoom drops all others, and is taken. `order` only ever grows.
  void push(std::string text, Worth worth, std::uint64_t order);
  [[nodiscard]] bool empty() const noexcept { return texts_.empty(); }
  /// Of the oldest text; not when empty.
  [[nodiscard]] std::uint64_t order() const noexcept { return texts_.front().order; }
  /// At most `most` bytes of the oldest text; not when empty. Valid until taken() or clear(), also while texts come.
  [[nodiscard]] std::string_view begin(std::size_t most);
  /// `n` of the bytes that begin() gave have left.
  void taken(std::size_t n) noexcept;
  /// Nobody will ever take them.
  void clear() noexcept;
  /// Kept texts that were dropped.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }

 private:
  struct Text {
    std::string bytes;
    Worth worth = Worth::kept;
    std::uint64_t order = 0;
  };
  [[nodiscard]] std::list<Text>::iterator first_whole() noexcept;
  bool drop_one() noexcept;

  std::list<Text> texts_;
  std::size_t size_ = 0;   ///< bytes of all
  std::size_t gone_ = 0;   ///< bytes of the oldest that have left
  bool is_begun_ = false;  ///< the oldest may be on its way
  std::uint64_t lost_ = 0;
  std::uint64_t untold_ = 0;  ///< of the lost: those before the oldest text, which nobody was told of
};

}  // namespace kphi::daq
