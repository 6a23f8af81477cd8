// Files that a verb writes where its user says (--out), and which can be made again at any time.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace kphi::commands {

/// What lies at `path` is nothing, empty, or of the kind of `text`: written by kphi, the same kind of file. Throws
/// ConfigurationError.
void require_own_or_new(const std::filesystem::path& path, std::string_view text);

/// As a whole, without waiting for the disk; where `path` is a link, the file that it stands for. Throws
/// ConfigurationError as require_own_or_new, RecordError. `kind`: a text of its kind, where `text` itself is not yet
/// one.
void write_output(const std::filesystem::path& path, const std::string& text, std::string_view kind = {});

}  // namespace kphi::commands
