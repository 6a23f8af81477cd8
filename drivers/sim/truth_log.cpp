#include "drivers/sim/truth_log.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "base/json.hpp"

namespace kphi::sim {
namespace {

using nlohmann::ordered_json;

void add(std::string& lines, const ordered_json& line) { lines += line.dump() + "\n"; }

void add_done(ordered_json& totals, const std::map<FaultKind, std::uint64_t>& done) {
  for (const auto& [kind, count] : done) totals[std::string(name_of(kind))] = count;
}

ordered_json totals_of(const WireTruth& truth) {
  ordered_json totals;
  KPHI_JSON_MEMBERS(totals, truth, sent, records_sent, arrived, records_arrived, dropped, records_dropped, duplicated,
                    records_duplicated, overtaken, delayed, malformed, foreign, records_left_out, to_others,
                    records_to_others, starts, unheard, restarts, reboots);
  add_done(totals, truth.done);
  return totals;
}

std::string_view name_of(PowerStage::Mode mode) noexcept {
  constexpr std::array<std::string_view, 3> kNames{"coast", "brake", "drive"};
  return kNames[static_cast<std::size_t>(mode)];
}

}  // namespace

std::string json_lines(const WireTruth& truth) {
  std::string lines;
  for (const FaultEvent& event : truth.events) add(lines, {{"at_ns", event.at.count()}, {"event", event.what}});
  for (const SentDatagram& d : truth.log) {
    ordered_json line{{"sent_ns", d.sent.count()}};
    KPHI_JSON_MEMBERS(line, d, boot, stream, first_rdt, first_ft, last_ft, records, samples, arrivals);
    if (d.arrivals > 0) line["first_arrival_ns"] = d.first_arrival.count();
    if (d.first_sample < truth.sampled.size()) line["first_sampled_ns"] = truth.sampled[d.first_sample].count();
    add(lines, line);
  }
  add(lines, {{"totals", totals_of(truth)}});
  return lines;
}

std::string summary(const WireTruth& truth) {
  std::string out;
  const ordered_json totals = totals_of(truth);
  for (const auto& [name, count] : totals.items()) {
    if (count != 0) out += fmt::format("{}{} {}", out.empty() ? "" : ", ", name, count.get<std::uint64_t>());
  }
  return out.empty() ? "nothing was sent" : out;
}

std::string json_lines(const IqTruth& truth) {
  std::string lines;
  for (const FaultEvent& event : truth.events) add(lines, {{"at_ns", event.at.count()}, {"motor_event", event.what}});
  for (const SentIqReply& r : truth.log) {
    ordered_json line{{"asked_ns", r.asked.count()},
                      {"begun_ns", r.begun.count()},
                      {"type", r.type},
                      {"sub", r.sub},
                      {"id", r.id},
                      {"data", fmt::format("{:02x}", fmt::join(r.data(), ""))},
                      {"arrivals", r.arrivals}};
    if (r.arrivals > 0) line["arrived_ns"] = r.arrived.count();
    if (std::isfinite(r.truth)) line["truth"] = r.truth;
    for (const FaultKind kind : r.done) line["faults"].push_back(name_of(kind));
    add(lines, line);
  }
  ordered_json totals;
  KPHI_JSON_MEMBERS(totals, truth, bytes_from_host, bytes_to_module, bytes_from_module, bytes_to_host, replies,
                    frames_arrived, spoilt);
  add_done(totals, truth.done);
  add(lines, {{"motor_totals", totals}});
  return lines;
}

std::string_view name_of(MotorDrive::Mode mode) noexcept {
  constexpr std::array<std::string_view, 5> kNames{"brake", "coast", "volts", "pwm", "velocity"};
  return kNames[static_cast<std::size_t>(mode)];
}

void MotionLog::look(const IqDevice& motor, double speed, Instant now) {
  const IqMotion& motion = motor.last_motion();
  if (motion.at != command_.at || motion.mode != command_.mode || motion.target != command_.target) {
    command_ = motion;
    const char* target = motion.mode == MotorDrive::Mode::velocity ? "target_rad_s" : "target";
    add(lines_, {{"at_ns", motion.at.count()}, {"motion_command", name_of(motion.mode)}, {target, motion.target}});
  }
  const PowerStage::Mode mode = motor.stage().mode;
  if (stage_ != mode) add(lines_, {{"at_ns", now.count()}, {"stage", name_of(mode)}, {"speed_rad_s", speed}});
  stage_ = mode;
}

void MotionLog::look(const SupplyCircuit& supply, Instant now) {
  if (output_ != supply.output()) add(lines_, {{"at_ns", now.count()}, {"supply_output", supply.output()}});
  output_ = supply.output();
}

}  // namespace kphi::sim
