#include "fit/export/run_export.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <chrono>
#include <map>
#include <ostream>

#include "fit/export/mcap_writer.hpp"
#include "results/reduction/clock_map.hpp"

namespace kphi::fit {
namespace {

constexpr std::array<const char*, 6> kAxes{"force_x_n",   "force_y_n",   "force_z_n",
                                           "torque_x_nm", "torque_y_nm", "torque_z_nm"};

double physical(const LoadCellRecord& record, const results::LoadCellScale& scale, std::size_t axis) {
  return record.counts[axis] / (axis < 3 ? scale.counts_per_newton : scale.counts_per_newton_metre);
}

std::string schema_of(const std::vector<const char*>& names) {
  return fmt::format(R"({{"type":"object","properties":{{"{}":{{"type":"number"}}}}}})",
                     fmt::join(names, R"(":{"type":"number"},")"));
}

void write_load_cell(const results::RunRecording& run, std::uint64_t epoch, McapWriter& writer) {
  std::vector<const char*> names(kAxes.begin(), kAxes.end());
  names.insert(names.end(), {"ft_sequence", "status"});
  const auto channel = writer.add_channel("/load_cell", "kphi.LoadCell", schema_of(names));
  const std::vector<Nanoseconds> times = results::sample_times(run);
  std::string json;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const LoadCellRecord& record = run.load_cell[i];
    json.assign(1, '{');
    for (std::size_t axis = 0; axis < kAxes.size(); ++axis)
      fmt::format_to(std::back_inserter(json), "\"{}\":{:.7g},", kAxes[axis],
                     physical(record, run.header.load_cell, axis));
    fmt::format_to(std::back_inserter(json), "\"ft_sequence\":{},\"status\":{}}}", record.ft_sequence, record.status);
    writer.write(channel, epoch + static_cast<std::uint64_t>(times[i]), json);
  }
}

void write_motor(const results::RunRecording& run, std::uint64_t epoch, McapWriter& writer) {
  std::map<MotorChannel, std::uint16_t> channels;
  for (const MotorReading& reading : run.motor) {
    const auto& info = kMotorChannels[static_cast<std::size_t>(reading.channel)];
    if (!channels.contains(reading.channel)) {
      channels[reading.channel] = writer.add_channel(std::string("/motor/") + info.name, "kphi.Reading",
                                                     schema_of({"value"}), {{"unit", info.unit}});
    }
    writer.write(channels[reading.channel], epoch + static_cast<std::uint64_t>(reading.time_ns),
                 fmt::format("{{\"value\":{:.9g}}}", reading.value));
  }
}

void write_phases(const results::RunRecording& run, std::uint64_t epoch, McapWriter& writer) {
  const auto channel = writer.add_channel("/phase", "kphi.Phase", schema_of({"phase", "step", "commanded_rad_s"}));
  for (const results::PhaseMark& mark : run.phases) {
    writer.write(channel, epoch + static_cast<std::uint64_t>(mark.time_ns),
                 fmt::format("{{\"phase\":{},\"step\":{},\"commanded_rad_s\":{:.9g}}}", static_cast<int>(mark.phase),
                             mark.step, mark.speed_rad_s));
  }
}

}  // namespace

std::uint64_t nanoseconds_since_1970(const std::string& utc) {
  int year = 0;
  unsigned month = 0, day = 0, hour = 0, minute = 0, second = 0;
  if (std::sscanf(utc.c_str(), "%d-%u-%uT%u:%u:%u", &year, &month, &day, &hour, &minute, &second) != 6) return 0;
  using namespace std::chrono;
  const year_month_day date{std::chrono::year(year), std::chrono::month(month), std::chrono::day(day)};
  if (!date.ok() || year < 1970 || year > 2200) return 0;
  const auto time = sys_days(date) + hours(hour) + minutes(minute) + seconds(second);
  return static_cast<std::uint64_t>(duration_cast<nanoseconds>(time.time_since_epoch()).count());
}

std::vector<std::string> run_to_mcap(const results::RunRecording& run, std::ostream& out) {
  const std::uint64_t epoch = nanoseconds_since_1970(run.header.started_utc);
  McapWriter writer(out, "kphi " + run.header.tool_version);
  write_phases(run, epoch, writer);
  write_motor(run, epoch, writer);
  write_load_cell(run, epoch, writer);
  writer.add_metadata("kphi-run", {{"origin", name_of(origin_named(run.header.origin))},
                                   {"uuid", run.header.uuid},
                                   {"campaign", run.header.campaign_name},
                                   {"propeller", run.header.propeller_id},
                                   {"occlusion_deg", fmt::format("{}", run.header.occlusion_deg)},
                                   {"repetition", fmt::format("{}", run.header.repetition)},
                                   {"started_utc", run.header.started_utc},
                                   {"calibration", run.header.load_cell.serial},
                                   {"units", "N, N m, rad/s, s"}});
  writer.close();
  return {"raw counts: messages are in N and N m, to seven digits; the counts are in the run file",
          "start within its second: stamps are the start, to a second, plus the run's own nanoseconds"};
}

std::vector<std::string> run_to_csv(const results::RunRecording& run, std::ostream& out) {
  out << "time_s";
  for (const char* axis : kAxes) out << ',' << axis;
  out << ",ft_sequence,status,origin\n";
  const char* const origin = name_of(origin_named(run.header.origin));
  const std::vector<Nanoseconds> times = results::sample_times(run);
  std::string row;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const LoadCellRecord& record = run.load_cell[i];
    row = fmt::format("{:.9f}", 1e-9 * static_cast<double>(times[i]));
    for (std::size_t axis = 0; axis < kAxes.size(); ++axis)
      fmt::format_to(std::back_inserter(row), ",{:.7g}", physical(record, run.header.load_cell, axis));
    fmt::format_to(std::back_inserter(row), ",{},{},{}\n", record.ft_sequence, record.status, origin);
    out << row;
  }
  return {
      "the motor's channels: their times differ from the load cell's, and a table has one time; --to mcap stores both"};
}

}  // namespace kphi::fit
