// Text from outside: files that a person names, read in bounded memory and without waiting; words for a terminal.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace kphi {

/// The file's bytes, `most_bytes` at most. Throws std::runtime_error ("cause; next move", without the file's name) if
/// the file cannot be opened or read, is longer, or is a folder, a pipe or a device.
[[nodiscard]] std::string read_text_file(const std::filesystem::path& path, std::size_t most_bytes);

enum class LineEnds { replace, keep };

/// Valid UTF-8 without control characters, fit for a terminal and for JSON: each byte or character that is neither
/// becomes U+FFFD. What a device or a file says could otherwise clear the screen or rename its window.
[[nodiscard]] std::string printable(std::string_view text, LineEnds line_ends = LineEnds::replace);

}  // namespace kphi
