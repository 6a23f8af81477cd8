#include "drivers/sim/wire_truth.hpp"

#include <nlohmann/json.hpp>

namespace kphi::sim {

std::string json_lines(const WireTruth& truth) {
  using nlohmann::ordered_json;
  std::string out;
  const auto add = [&](const ordered_json& line) { out += line.dump() + "\n"; };
  for (const FaultEvent& event : truth.events) add({{"at_ns", event.at.count()}, {"event", event.what}});
  for (const SentDatagram& d : truth.log) {
    ordered_json line{{"sent_ns", d.sent.count()}, {"boot", d.boot},         {"stream", d.stream},
                      {"first_rdt", d.first_rdt},  {"first_ft", d.first_ft}, {"last_ft", d.last_ft},
                      {"records", d.records},      {"samples", d.samples},   {"arrivals", d.arrivals}};
    if (d.arrivals > 0) line["first_arrival_ns"] = d.first_arrival.count();
    if (d.first_sample < truth.sampled.size()) line["first_sampled_ns"] = truth.sampled[d.first_sample].count();
    add(line);
  }
  add({{"totals",
        {{"sent", truth.sent},
         {"records_sent", truth.records_sent},
         {"arrived", truth.arrived},
         {"records_arrived", truth.records_arrived},
         {"dropped", truth.dropped},
         {"records_dropped", truth.records_dropped},
         {"duplicated", truth.duplicated},
         {"records_duplicated", truth.records_duplicated},
         {"overtaken", truth.overtaken},
         {"delayed", truth.delayed},
         {"malformed", truth.malformed},
         {"foreign", truth.foreign},
         {"to_others", truth.to_others},
         {"records_to_others", truth.records_to_others},
         {"starts", truth.starts},
         {"starts_lost", truth.starts_lost},
         {"starts_doubled", truth.starts_doubled},
         {"starts_delayed", truth.starts_delayed},
         {"unheard", truth.unheard},
         {"thefts", truth.thefts},
         {"restarts", truth.restarts},
         {"reboots", truth.reboots},
         {"stalls", truth.stalls},
         {"jumps", truth.jumps},
         {"http_spoilt", truth.http_spoilt}}}});
  return out;
}

}  // namespace kphi::sim
