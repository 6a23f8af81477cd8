// Text from outside: files that a person names, read in bounded memory and without waiting; words for a terminal.
#pragma once

#include <concepts>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <istream>
#include <string>
#include <string_view>
#include <utility>

#include "base/descriptor.hpp"

namespace kphi {

/// In bytes; a longer line means a binary file.
inline constexpr std::size_t kLongestLine = std::size_t{1} << 20;

/// The next line of a stream, without its end; false at the end. Throws std::runtime_error ("cause; next move") beyond
/// kLongestLine.
[[nodiscard]] bool next_line(std::istream& in, std::string& line);

/// The file's bytes, `most_bytes` at most. Throws std::runtime_error ("cause; next move", without the file's name) if
/// the file cannot be opened or read, is longer, has a line beyond kLongestLine, or is a folder, a pipe or a device.
[[nodiscard]] std::string read_text_file(const std::filesystem::path& path, std::size_t most_bytes);

/// A text in blocks of whole lines, one at hand at a time: the whole of it, or piece by piece where it is too long for
/// memory.
class TextBlocks {
 public:
  template <std::convertible_to<std::string_view> Text>
  TextBlocks(const Text& whole) : front_(whole), bytes_(front_.size()) {}
  /// `next` gives the next block, which stays valid until it is called again; an empty one at the end. `bytes`: of the
  /// whole text, about.
  TextBlocks(std::function<std::string_view()> next, std::size_t bytes)
      : next_(std::move(next)), front_(next_()), bytes_(bytes) {}

  /// The block at hand; empty at the end.
  [[nodiscard]] std::string_view front() const { return front_; }
  void pop() { front_ = next_ ? next_() : std::string_view(); }
  /// Of the whole text, about: to make room for what it gives.
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  std::function<std::string_view()> next_;
  std::string_view front_;
  std::size_t bytes_;
};

/// A file that is read in blocks of whole lines of about 1 MiB. Refuses as read_text_file does.
class TextFile {
 public:
  TextFile(const std::filesystem::path& path, std::size_t most_bytes);
  /// Valid until the next call; empty at the end. The last line may lack its line break.
  [[nodiscard]] std::string_view next_block();
  /// All that is left, whatever its bytes are.
  [[nodiscard]] std::string rest();
  /// Bytes, when it was opened.
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  /// Appends what one call of read(2) gives; 0 at the end of the file.
  std::size_t read_more();

  Descriptor file_;
  std::size_t most_bytes_;
  std::size_t size_ = 0, read_ = 0;
  std::string bytes_;      ///< handed out, and the begin of the next line
  std::size_t given_ = 0;  ///< of them
};

enum class LineEnds { replace, keep };

/// Valid UTF-8 without control characters, fit for a terminal and for JSON: each byte or character that is neither
/// becomes U+FFFD. What a device or a file says could otherwise clear the screen or rename its window.
[[nodiscard]] std::string printable(std::string_view text, LineEnds line_ends = LineEnds::replace);

/// A name or a value of somebody else, for a message: printable, in quotes, its first 80 bytes.
[[nodiscard]] std::string in_quotes(std::string_view foreign);

}  // namespace kphi
