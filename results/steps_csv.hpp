// steps.csv: one row per step of every run. UTF-8, LF, a header line with the units in the names, shortest round trip
// numbers; an unmeasured number is an empty field (NaN in memory), a text is one line. Optional columns (bench supply,
// air density, uncertainties) follow in groups, each present if one of the steps has it.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "results/file_layer.hpp"
#include "results/step_mean.hpp"

namespace kphi::results {

/// Names of the set bits of QualityFlag joined by '+'; empty for none.
[[nodiscard]] std::string quality_flag_names(std::uint32_t flags);
/// The same for a person: "commanded speed not reached, motor derated".
[[nodiscard]] std::string quality_flags_in_words(std::uint32_t flags);
/// How many steps are flagged, and how often by which flag.
struct FlaggedSteps {
  int steps = 0, flagged = 0;
  std::array<int, 32> by_bit{};  ///< of QualityFlag
  void add(std::uint32_t flags) noexcept;
};
/// "3 of 3 steps flagged (thrust never settled 3, supply sagged 1)": the most frequent first, four at most; whether
/// none of them spoils k.
[[nodiscard]] std::string in_words(const FlaggedSteps& steps);
/// By the names of steps.csv, without those that no step has.
[[nodiscard]] std::map<std::string, int> flag_counts(const FlaggedSteps& steps);
/// Inverse of quality_flag_names(). Throws std::invalid_argument naming the unknown word.
[[nodiscard]] std::uint32_t quality_flags_from_names(std::string_view names);

/// The whole file: the same bytes live and in replay.
[[nodiscard]] std::string format_steps(std::span<const StepMean> steps);

/// Steps made one by one, where all at once are too many for memory; each is asked for twice, from any
/// thread.
struct StepSource {
  std::size_t count = 0;
  std::function<StepMean(std::size_t)> step;
};

/// Columns by name, in any order; optional ones may be missing. Throws ConfigurationError "name:line: …" for an
/// unknown, missing or repeated column and for an invalid field.
[[nodiscard]] std::vector<StepMean> parse_steps(std::string_view text, const std::string& name);

/// Replaces `path` atomically. Throws RecordError.
void write_steps(const std::filesystem::path& path, std::span<const StepMean> steps, FileLayer& files = disk());
void write_steps(const std::filesystem::path& path, const StepSource& steps, FileLayer& files = disk());
/// Throws RecordError for an unreadable file, ConfigurationError for an invalid one.
[[nodiscard]] std::vector<StepMean> read_steps(const std::filesystem::path& path);

}  // namespace kphi::results
