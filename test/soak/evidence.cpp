#include "test/soak/evidence.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "results/file_layer.hpp"
#include "results/reduction/reduction.hpp"
#include "results/run_reader.hpp"

namespace kphi::soak {
namespace {

/// Under whatever name.
bool is_inherited(const std::filesystem::path& path, const Inheritance& inherited) {
  if (inherited.files.empty()) return false;
  const std::string bytes = results::read_text(path);
  return std::any_of(inherited.files.begin(), inherited.files.end(),
                     [&](const auto& file) { return file.second == bytes; });
}

void read(const std::filesystem::path& path, Evidence& evidence) {
  const bool inherited = is_inherited(path, evidence.inherited);
  try {
    FileOfRun file{path, results::read_run(path), {}, inherited};
    if (file.run.outcome == results::Outcome::complete && !file.run.phases.empty())
      file.steps = results::reduce(file.run);
    evidence.files.push_back(std::move(file));
  } catch (const RecordError& error) {
    if (!inherited) evidence.unreadable.push_back({path, error.what()});
  }
}

}  // namespace

Evidence evidence_of(World& world) {
  Evidence evidence{world.mixture(),
                    world.campaign(),
                    world.config(),
                    world.story(),
                    nullptr,
                    world.inherited(),
                    world.left(),
                    {},
                    world.disk().refused(),
                    {},
                    {}};
  for (const auto& path : world.disk().secured()) evidence.secured.insert(path.filename().string());
  if (world.bench() != nullptr) evidence.wire = &world.bench()->simulation().wire().truth();
  if (!world.left()) return evidence;
  for (const auto& path : world.left()->complete_runs()) read(path, evidence);
  for (const auto& path : world.left()->other_runs()) read(path, evidence);
  return evidence;
}

}  // namespace kphi::soak
