// The lines of both boards of this bench: $L,123,-4567*5A and a newline, the checksum as in NMEA 0183: the exclusive or
// of all characters between $ and *, two hexadecimal digits.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kphi::second_bench {

/// "$" + words + "*hh\n".
[[nodiscard]] std::string checked(const std::string& words);

class CheckedLines {
 public:
  void take(std::string_view bytes);
  /// The numbers of the oldest line that begins with `letter`; nullopt: none. Lines of another form are counted.
  [[nodiscard]] std::optional<std::vector<std::int64_t>> next(char letter, std::size_t numbers);
  [[nodiscard]] std::uint64_t malformed() const noexcept { return malformed_; }

 private:
  std::string heard_;
  std::uint64_t malformed_ = 0;
};

}  // namespace kphi::second_bench
