#include "commands/outputs.hpp"

#include <fmt/format.h>

#include <array>
#include <bitset>
#include <fstream>

#include "base/error.hpp"
#include "results/file_layer.hpp"

namespace kphi::commands {
namespace {

namespace fs = std::filesystem;

/// By what kphi's files differ from those of others, and from each other.
constexpr std::array kMarks{
    std::string_view("format: kphi-coefficients/"), std::string_view("<title>k(φ) of "),
    std::string_view("<title>K_T of "), std::string_view("\"kphi-import/1\""),
    // kphi export
    std::string_view("fitted by kphi "), std::string_view("thrust_map"), std::string_view("CA_ROTOR0_"),
    std::string_view("<sdf "), std::string_view("ros__parameters"), std::string_view("#pragma once"),
    std::string_view("phi_deg,k_n_s2_per_rad2,"), std::string_view("time_s,force_x_n,"), std::string_view("\x89MCAP"),
    std::string_view("kphi.Coefficient"), std::string_view("kphi.Phase"),
    // kphi fly
    std::string_view("time_s,leg,reference_x_m,"), std::string_view("draw,law,gamma,"),
    std::string_view("noenhanced font 'Helvetica,Arial,sans-serif,14'"),
    // kphi sim
    std::string_view("format: kphi-truth/"), std::string_view("\"motor_totals\""),
    std::string_view("# written by kphi sim")};
constexpr std::size_t kLooked = std::size_t{1} << 14;  // of its beginning, and of its end

using Marks = std::bitset<kMarks.size()>;

/// None: not kphi's.
Marks marks_of(std::string_view text) {
  const std::string_view head = text.substr(0, kLooked);
  const std::string_view tail = text.size() > kLooked ? text.substr(text.size() - kLooked) : head;
  Marks kind;
  for (std::size_t i = 0; i < kMarks.size(); ++i)
    kind[i] = head.find(kMarks[i]) != head.npos || tail.find(kMarks[i]) != tail.npos;
  return kind;
}

/// The first and the last bytes of a file.
std::string ends_of(const fs::path& path, std::uintmax_t size) {
  std::ifstream file(path, std::ios::binary);
  std::string text(std::min<std::uintmax_t>(size, 2 * kLooked), '\0');
  const std::size_t head = std::min(text.size(), kLooked);
  file.read(text.data(), static_cast<std::streamsize>(head));
  file.seekg(-static_cast<std::streamoff>(text.size() - head), std::ios::end);
  file.read(text.data() + head, static_cast<std::streamsize>(text.size() - head));
  return text;
}

}  // namespace

void require_own_or_new(const fs::path& path, std::string_view text) {
  std::error_code none;
  const fs::file_status there = fs::status(path, none);
  if (!fs::exists(there)) return;
  if (fs::is_directory(there)) throw ConfigurationError(path.string() + ": is a folder; name a file in it");
  if (!fs::is_regular_file(there)) throw ConfigurationError(path.string() + ": is a pipe or a device; name a file");
  const std::uintmax_t size = fs::file_size(path, none);
  if (size == 0) return;
  const Marks wanted = marks_of(text);
  if (wanted.any() && marks_of(ends_of(path, size)) == wanted) return;
  throw ConfigurationError(path.string() +
                           ": exists, and is not a file of this kind that kphi has written; choose another name");
}

void write_output(const fs::path& path, const std::string& text, std::string_view kind) {
  std::error_code none;
  if (const fs::path folder = path.parent_path(); !folder.empty() && !fs::is_directory(folder, none))
    throw ConfigurationError(
        fmt::format("{}: the folder {} does not exist; create it, or choose another", path.string(), folder.string()));
  require_own_or_new(path, kind.empty() ? text : kind);
  const fs::path target = fs::is_symlink(path, none) ? fs::weakly_canonical(path, none) : path;
  results::MemoryOnlySync files;
  results::write_text(target.empty() ? path : target, text, files);
}

}  // namespace kphi::commands
