#include "results/campaign_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <map>
#include <optional>
#include <tuple>

#include "base/number.hpp"

namespace kphi::results {
namespace {

std::string file_name_safe(std::string text) {
  for (char& c : text) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '_' && c != '-') c = '_';
  }
  return text;
}

struct RunName {
  double occlusion_deg = 0;
  int repetition = 0;
  std::string propeller;
};

/// Inverse of run_file_name(); nullopt for other files.
std::optional<RunName> parse_run_name(const std::string& name) {
  const std::size_t phi = name.rfind("_phi");
  const std::size_t place = std::min(name.find("_rep", phi), name.find("_ref", phi));
  if (!name.ends_with(".h5") || phi == std::string::npos || place == std::string::npos) return std::nullopt;
  const auto angle = parse_double(name.substr(phi + 4, place - phi - 4));
  const auto number = parse_double(name.substr(place + 4, name.size() - 3 - place - 4));
  if (!angle || !number) return std::nullopt;
  const int sign = name[place + 3] == 'f' ? -1 : 1;
  return RunName{*angle, sign * static_cast<int>(*number), name.substr(0, phi)};
}

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  if (!std::filesystem::is_directory(folder)) return files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

/// By place of the occlusion in `occlusions_deg`, occlusion, number and propeller.
std::vector<std::filesystem::path> complete_files(const std::filesystem::path& folder, bool references,
                                                  std::span<const double> occlusions_deg) {
  using Key = std::tuple<std::ptrdiff_t, double, int, std::string>;
  std::multimap<Key, std::filesystem::path> found;
  for (const auto& file : files_in(folder)) {
    const auto name = parse_run_name(file.filename().string());
    if (!name || (name->repetition < 0) != references) continue;
    const auto place = std::ranges::find(occlusions_deg, name->occlusion_deg) - occlusions_deg.begin();
    found.emplace(Key{place, name->occlusion_deg, std::abs(name->repetition), name->propeller}, file);
  }
  std::vector<std::filesystem::path> paths;
  for (auto& [key, file] : found) paths.push_back(std::move(file));
  return paths;
}

}  // namespace

std::string run_file_name(const std::string& propeller_id, double occlusion_deg, int repetition) {
  std::string angle = shortest(occlusion_deg);
  const std::size_t whole = std::min(angle.find('.'), angle.size());
  if (whole < 3) angle.insert(0, 3 - whole, '0');
  return fmt::format("{}_phi{}_{}{}.h5", file_name_safe(propeller_id), angle, repetition < 0 ? "ref" : "rep",
                     std::abs(repetition));
}

CampaignFolder CampaignFolder::create(const std::filesystem::path& parent, const std::string& utc,
                                      const std::string& name, FileLayer& files) {
  const std::string base = (parent / file_name_safe(utc + "_" + name)).string();
  return on_disk(base, [&] {
    std::filesystem::create_directories(parent);
    std::filesystem::path path = base;
    for (int i = 2; !std::filesystem::create_directory(path); ++i) path = fmt::format("{}-{}", base, i);
    CampaignFolder folder(path);
    std::filesystem::create_directory(folder.runs());
    std::filesystem::create_directory(folder.figures());
    files.sync_folder(folder.path());
    files.sync_folder(parent);
    return folder;
  });
}

CampaignFolder CampaignFolder::open(const std::filesystem::path& path) {
  CampaignFolder folder(path.has_filename() ? path : path.parent_path());
  if (std::filesystem::exists(folder.journal()) || std::filesystem::is_directory(folder.runs())) return folder;
  throw RecordError(path.string() +
                    ": not a campaign folder: no journal.jsonl and no runs/ in it; name a folder made by kphi run");
}

std::vector<std::filesystem::path> CampaignFolder::complete_runs(std::span<const double> occlusions_deg) const {
  return complete_files(runs(), false, occlusions_deg);
}

std::vector<std::filesystem::path> CampaignFolder::reference_runs() const { return complete_files(runs(), true, {}); }

std::vector<std::filesystem::path> CampaignFolder::other_runs() const {
  std::vector<std::filesystem::path> paths = files_in(runs());
  std::erase_if(paths, [](const auto& file) { return parse_run_name(file.filename().string()).has_value(); });
  return paths;
}

}  // namespace kphi::results
