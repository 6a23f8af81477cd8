#include "results/run_layout.hpp"

#include <nlohmann/json.hpp>

#include "results/sha256.hpp"

namespace kphi::results {

std::string attributes_digest(const RunHeader& header, const RunEnding& ending) {
  nlohmann::json all;
  const auto add = [&](const char* name, const auto& value) { all[name] = value; };
  for_each_attribute(header, add);
  for_each_figure(ending, add);
  add("outcome", outcome_name(ending.outcome));
  add("outcome_reason", ending.outcome_reason);
  return sha256(all.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

const char* outcome_name(Outcome outcome) { return outcome == Outcome::complete ? "complete" : "aborted"; }

}  // namespace kphi::results
