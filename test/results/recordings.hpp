// Run files looked at by tests: are two recordings the same, row by row?
#pragma once

#include <algorithm>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "results/records.hpp"
#include "results/run_layout.hpp"

namespace kphi::results::test {

inline bool same(const LoadCellRecord& a, const LoadCellRecord& b) {
  return a.counts == b.counts && a.rdt_sequence == b.rdt_sequence && a.ft_sequence == b.ft_sequence &&
         a.status == b.status && a.arrival_ns == b.arrival_ns;
}

inline bool same(const MotorReading& a, const MotorReading& b) {
  return a.channel == b.channel && a.time_ns == b.time_ns && a.uncertainty_ns == b.uncertainty_ns && a.value == b.value;
}

inline bool same(const PhaseMark& a, const PhaseMark& b) {
  return a.phase == b.phase && a.step == b.step && a.time_ns == b.time_ns && a.speed_rad_s == b.speed_rad_s;
}

template <class Row>
bool same_rows(const std::vector<Row>& a, const std::vector<Row>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Row& x, const Row& y) { return same(x, y); });
}

/// What the error that `action` throws says; other errors pass.
template <class Expected = std::exception, class Action>
std::string error_of(Action&& action) {
  try {
    action();
  } catch (const Expected& error) {
    return error.what();
  }
  return "no error";
}

/// Of all that a run file says in attributes.
inline std::string digest(const RunRecording& run) { return attributes_digest(run.header, run); }

/// A finished run is read-only; tests that damage one take that back.
inline void make_writable(const std::filesystem::path& path) {
  std::filesystem::permissions(path, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
}

}  // namespace kphi::results::test
