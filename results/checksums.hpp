// What shows a later change of files that kphi wrote beside its runs: a last line over the lines above it, and a list
// in the format of sha256sum, which `sha256sum -c SHA256SUMS` reads.
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kphi::results {

/// The name of a file within a folder, by the name alone: relative, and nowhere "..".
[[nodiscard]] bool lies_inside(const std::filesystem::path& name);

/// `text` with its last line: "# sha256: …" over all that stands above it.
[[nodiscard]] std::string sealed(std::string text);
/// Throws DataRejected if the last line is such a seal and does not match; a text without one is let pass.
void require_seal(std::string_view text, const std::string& path);

inline constexpr const char* kSumsFile = "SHA256SUMS";

/// File, relative to the folder → SHA-256; empty without the list. Throws DataRejected for a line that is none.
[[nodiscard]] std::map<std::string, std::string> read_sums(const std::filesystem::path& folder);
/// Enters these files, which lie in the folder, and keeps the other entries.
void record_sums(const std::filesystem::path& folder, std::span<const std::filesystem::path> written);
/// One line for each file of the list that is missing or changed, and for each of `made`, which kphi enters when it
/// writes them, that is there without a line.
[[nodiscard]] std::vector<std::string> unlike_sums(const std::filesystem::path& folder,
                                                   std::span<const std::filesystem::path> made = {});

}  // namespace kphi::results
