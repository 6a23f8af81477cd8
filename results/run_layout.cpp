#include "results/run_layout.hpp"

#include <nlohmann/json.hpp>

#include "results/sha256.hpp"

namespace kphi::results {

std::string attributes_digest(const RunHeader& header, const SampleAccount& account, Outcome outcome,
                              const std::string& reason) {
  nlohmann::json all;
  const auto add = [&](const char* name, const auto& value) { all[name] = value; };
  for_each_attribute(header, add);
  for_each_count(account, add);
  add("outcome", outcome_name(outcome));
  add("outcome_reason", reason);
  return sha256(all.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

const char* outcome_name(Outcome outcome) { return outcome == Outcome::complete ? "complete" : "aborted"; }

}  // namespace kphi::results
