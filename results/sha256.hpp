// SHA-256 of bytes and of files, as 64 lower-case hex digits.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace kphi::results {

[[nodiscard]] std::string sha256(std::string_view bytes);
/// Throws RecordError when the file cannot be read to its end.
[[nodiscard]] std::string sha256_of_file(const std::filesystem::path& path);

}  // namespace kphi::results
