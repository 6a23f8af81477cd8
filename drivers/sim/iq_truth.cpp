#include "drivers/sim/iq_truth.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace kphi::sim {

std::string json_lines(const IqTruth& truth) {
  using nlohmann::ordered_json;
  std::string out;
  const auto add = [&](const ordered_json& line) { out += line.dump() + "\n"; };
  for (const FaultEvent& event : truth.events) add({{"at_ns", event.at.count()}, {"motor_event", event.what}});
  for (const SentIqReply& r : truth.log) {
    std::string data;
    for (const std::uint8_t byte : r.data()) data += fmt::format("{:02x}", byte);
    ordered_json line{{"asked_ns", r.asked.count()},
                      {"begun_ns", r.begun.count()},
                      {"type", r.type},
                      {"sub", r.sub},
                      {"id", r.id},
                      {"data", data},
                      {"arrivals", r.arrivals}};
    if (r.arrivals > 0) line["arrived_ns"] = r.arrived.count();
    if (std::isfinite(r.truth)) line["truth"] = r.truth;
    for (int kind = 0; kind < kMotorFaultKinds; ++kind) {
      if ((r.done >> kind & 1u) != 0) line["faults"].push_back(name_of(static_cast<MotorFaultKind>(kind)));
    }
    add(line);
  }
  ordered_json totals{{"bytes_from_host", truth.bytes_from_host},
                      {"bytes_to_module", truth.bytes_to_module},
                      {"bytes_from_module", truth.bytes_from_module},
                      {"bytes_to_host", truth.bytes_to_host},
                      {"replies", truth.replies},
                      {"frames_arrived", truth.frames_arrived},
                      {"spoilt", truth.spoilt}};
  for (int kind = 0; kind < kMotorFaultKinds; ++kind) {
    const auto count = truth.done[static_cast<std::size_t>(kind)];
    if (count > 0) totals[std::string(name_of(static_cast<MotorFaultKind>(kind)))] = count;
  }
  add({{"motor_totals", totals}});
  return out;
}

}  // namespace kphi::sim
