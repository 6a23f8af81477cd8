#include "drivers/sim/wire_truth.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace kphi::sim {
namespace {

struct Total {
  const char* name;
  std::uint64_t WireTruth::*member;
};

using T = WireTruth;
constexpr Total kTotals[] = {
    {"sent", &T::sent},
    {"records_sent", &T::records_sent},
    {"arrived", &T::arrived},
    {"records_arrived", &T::records_arrived},
    {"dropped", &T::dropped},
    {"records_dropped", &T::records_dropped},
    {"duplicated", &T::duplicated},
    {"records_duplicated", &T::records_duplicated},
    {"overtaken", &T::overtaken},
    {"delayed", &T::delayed},
    {"malformed", &T::malformed},
    {"foreign", &T::foreign},
    {"records_left_out", &T::records_left_out},
    {"to_others", &T::to_others},
    {"records_to_others", &T::records_to_others},
    {"starts", &T::starts},
    {"starts_lost", &T::starts_lost},
    {"starts_doubled", &T::starts_doubled},
    {"starts_delayed", &T::starts_delayed},
    {"unheard", &T::unheard},
    {"thefts", &T::thefts},
    {"restarts", &T::restarts},
    {"reboots", &T::reboots},
    {"stalls", &T::stalls},
    {"jumps", &T::jumps},
    {"overruns", &T::overruns},
    {"rate_changes", &T::rate_changes},
    {"moves", &T::moves},
    {"http_spoilt", &T::http_spoilt},
    {"tcp_spoilt", &T::tcp_spoilt},
};

}  // namespace

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
  ordered_json totals;
  for (const Total& total : kTotals) totals[total.name] = truth.*total.member;
  add({{"totals", totals}});
  return out;
}

std::string summary(const WireTruth& truth) {
  std::string out;
  for (const Total& total : kTotals) {
    if (truth.*total.member > 0)
      out += fmt::format("{}{} {}", out.empty() ? "" : ", ", total.name, truth.*total.member);
  }
  return out.empty() ? "nothing was sent" : out;
}

}  // namespace kphi::sim
