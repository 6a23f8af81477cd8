#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <chrono>
#include <ctime>
#include <fstream>
#include <thread>

#include "results/digest.hpp"
#include "results/file_layer.hpp"
#include "results/hdf5.hpp"
#include "results/reduction/clock_map.hpp"
#include "results/run_reader.hpp"
#include "results/run_writer.hpp"
#include "test/results/recordings.hpp"
#include "test/results/synthetic_run.hpp"
#include "test/source_dir.hpp"

namespace kphi::results::run_file_test {

using namespace test;
using namespace testing;

class RunFile : public testing::Test {
 protected:
  [[nodiscard]] RunRecording written() const {
    write_run(path, run);
    return read_run(path);
  }
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "a.h5";
  RunRecording run = make_run({});
};

TEST_F(RunFile, ReadsBackAsWritten) {
  const RunRecording again = written();
  EXPECT_TRUE(same_rows(run.load_cell, again.load_cell));
  EXPECT_TRUE(same_rows(run.motor, again.motor));
  EXPECT_TRUE(same_rows(run.phases, again.phases));
  EXPECT_EQ(digest(run), digest(again));
  EXPECT_EQ(again.header.operator_name, "Zoë");
  EXPECT_EQ(again.header.load_cell.configuration_xml.size(), 70000u);
  EXPECT_EQ(again.header.uuid, run.header.uuid);
}

TEST_F(RunFile, KeepsWhatHappenedToTheStreamItsHealthAndTheBoxesBias) {
  run.header.load_cell.slots_json = "{\"netftapi2.xml?index=0\": \"<netft/>\"}";
  for (std::size_t kind = 0; kind < kEventNames.size(); ++kind) {
    run.events.push_back({static_cast<EventKind>(kind), 1000 + static_cast<Nanoseconds>(kind), kind,
                          std::string(kind == 3 ? 2 * kEventTextBytes : kind, 'e')});
  }
  run.account.reordered = 5;
  run.health.skew_ppm = -31.5;
  run.health.queue_high_water = 412;
  run.motor_counts = {300, 298, 2, 1};
  run.box_bias = {7000, {1, 2, 3, 4, 5, 6}, {}, {}, {0, 0, 0, 0, 0, 0.25}};
  const RunRecording again = written();
  EXPECT_TRUE(verify_run(path).whole());
  EXPECT_EQ(digest(run), digest(again));
  EXPECT_EQ(again.header.load_cell.slots_json, run.header.load_cell.slots_json);
  EXPECT_EQ(again.health.skew_ppm, -31.5);
  EXPECT_EQ(again.motor_counts, run.motor_counts);
  EXPECT_EQ(again.box_bias.after_sd[5], 0.25);
  ASSERT_EQ(again.events.size(), run.events.size());
  for (std::size_t i = 0; i < run.events.size(); ++i) {
    EXPECT_EQ(again.events[i].kind, run.events[i].kind);
    EXPECT_EQ(again.events[i].time_ns, run.events[i].time_ns);
    EXPECT_EQ(again.events[i].records, run.events[i].records);
    EXPECT_EQ(again.events[i].text, run.events[i].text.substr(0, kEventTextBytes));
  }
}

TEST_F(RunFile, WithoutViewsHasNoSampleTimesAndNoPlot) {
  RunWriter writer(path, run.header);
  write_pieces(writer, run);
  (void)writer.finish(run);
  EXPECT_TRUE(verify_run(path).whole());
  const auto root = hdf5::open_file(path);
  EXPECT_FALSE(hdf5::has_attribute(root, "default"));
}

TEST_F(RunFile, HoldsTheTimeOfEachSampleAndAPlot) {
  run = make_run({.records_per_datagram = 40});
  write_run(path, run);
  const auto root = hdf5::open_file(path);
  const auto cell = hdf5::open_group(root, "load_cell"), plot = hdf5::open_group(root, "plot");
  std::vector<Nanoseconds> times(run.load_cell.size());
  hdf5::ColumnReader(cell, "t_ns", Stored::i64, "a.h5").read(0, times.size(), times.data());
  EXPECT_EQ(times, sample_times(run));
  EXPECT_TRUE(std::ranges::is_sorted(times, std::less_equal()));

  hdf5::ColumnReader column(plot, "thrust", Stored::f64, "a.h5");
  std::vector<double> time(column.rows()), thrust(column.rows()), speed(column.rows());
  column.read(0, thrust.size(), thrust.data());
  hdf5::ColumnReader(plot, "time", Stored::f64, "a.h5").read(0, time.size(), time.data());
  hdf5::ColumnReader(plot, "speed", Stored::f64, "a.h5").read(0, speed.size(), speed.data());
  EXPECT_NEAR(time[1] - time[0], 0.01, 1e-12);
  const StepMean last = reduce(run).back();
  double sum = 0, n = 0;
  for (std::size_t i = 0; i < time.size(); ++i) {
    if (time[i] < last.window_begin_s || time[i] > last.window_end_s) continue;
    sum += thrust[i];
    ++n;
    EXPECT_NEAR(speed[i], last.speed_rad_s, 0.01 * last.speed_rad_s);
  }
  EXPECT_NEAR(sum / n, last.thrust_n, 0.005);
}

TEST_F(RunFile, KeepsWhatTheReductionNeedsToKnowOfCampaignAndBench) {
  run.header.supply_voltage_v = 16;
  run.header.coil_temperature_max_degc = 110;
  run.header.clock_gain = 1.004;
  run.header.clock_gain_u = 2e-5;
  run.header.load_cell.saturation_bits = 1u << 27 | 1u << 30;
  const RunHeader again = written().header;
  EXPECT_EQ(again.supply_voltage_v, 16);
  EXPECT_EQ(again.coil_temperature_max_degc, 110);
  EXPECT_EQ(again.clock_gain, 1.004);
  EXPECT_EQ(again.clock_gain_u, 2e-5);
  EXPECT_EQ(again.load_cell.saturation_bits, 1u << 27 | 1u << 30);
}

TEST_F(RunFile, RefusesAnotherFormat) {
  write_run(path, run);
  test::make_writable(path);
  std::string bytes = read_text(path);
  bytes.replace(bytes.find(kRunFormat), 10, "kphi-run/9");
  std::ofstream(path, std::ios::binary) << bytes;
  EXPECT_THAT(error_of([&] { (void)read_run(path); }),
              HasSubstr("format \"kphi-run/9\" cannot be read, only \"kphi-run/1\"; use the version of kphi"));
}

/// Every dataset, unit, code and attribute of the file stands in the specification.
TEST_F(RunFile, IsDescribedInTheReadme) {
  const std::string readme = read_text(kphi::test::source_dir() + "/results/README.md");
  const auto told = [&](const std::string& words) { EXPECT_THAT(readme, HasSubstr(words)); };
  const auto tell_group = [&](const auto& group, const std::string& place) {
    for (const auto& column : group.columns) {
      told(place + column.name + "`");
      for (std::size_t code = 0; code < column.codes.size(); ++code) {
        const std::string name = column.codes[code];
        const bool is_event = std::string_view(column.name) == "kind";
        told(std::to_string(code) + " " + (is_event ? "`" + name + "`" : name));
      }
    }
  };
  tell_group(kLoadCellGroup, "`/load_cell/");
  tell_group(kCommandGroup, "`/commands/");
  tell_group(kPlotGroup, "`/plot/");
  told(std::string("`/load_cell/") + layout::kSampleTime.name + "`");
  tell_group(kSupplyGroup, "`/supply/");
  tell_group(kEventGroup, "`/events/");
  tell_group(motor_group(kMotorChannels[0]), "`/motor/<channel>/");
  for (const MotorChannelInfo& channel : kMotorChannels) told(std::string("`") + channel.name + "`");
  const RunHeader header;
  const RunEnding ending;
  for_each_attribute(header, [&](const char* name, const auto&) { told(name); });
  for_each_figure(ending, [&](const char* name, const auto&) { told(name); });
  told(std::string("`") + kRunFormat + "`");
}

TEST_F(RunFile, IsReadOnlyUnderItsFinalNameWithTheDigestsThatFinishGave) {
  const RunDigests digests = write_run(path, run);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.h5.part"));
  EXPECT_EQ(digests.sha256, sha256_of_file(path));
  LoadCellColumns cell;
  EXPECT_EQ(digests.contents_xxh128, read_run(path, cell).contents_xxh128);
  struct stat info {};
  ASSERT_EQ(stat((path).c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0222u, 0u);
}

TEST_F(RunFile, SameInputGivesSameBytesInAnotherProcess) {
  write_run(path, run);
  const std::time_t second = std::time(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    // Other heap contents and another time of day must not show in the file.
    std::vector<std::string> rubbish(1000, std::string(997, '\xA5'));
    rubbish.clear();
    while (std::time(nullptr) == second) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    write_run(folder / "b.h5", run);
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_EQ(status, 0);
  EXPECT_EQ(sha256_of_file(path), sha256_of_file(folder / "b.h5"));
}

TEST_F(RunFile, NeverOverwritesAFinalFile) {
  const std::string sha256 = write_run(path, run).sha256;
  EXPECT_THAT(error_of<RecordError>([&] { RunWriter writer(path, run.header); }), HasSubstr("exists already"));
  EXPECT_EQ(sha256, sha256_of_file(path));
}

TEST_F(RunFile, DoesNotReplaceAFileThatAppearedMeanwhile) {
  RunWriter writer(path, run.header);
  write_pieces(writer, run);
  std::ofstream(path) << "mine";
  EXPECT_THROW((void)writer.finish(run), RecordError);
  EXPECT_EQ(std::filesystem::file_size(path), 4u);
  EXPECT_TRUE(std::filesystem::exists(folder / "a.h5.part"));
}

TEST_F(RunFile, SetsAnInterruptedPartAside) {
  {
    RunWriter dies(path, run.header);
    dies.append(std::span<const LoadCellRecord>(run.load_cell).first(100));
  }
  write_run(path, run);
  EXPECT_TRUE(verify_run(path).whole());
  EXPECT_TRUE(std::filesystem::exists(folder / "a.interrupted.h5.part"));
}

TEST_F(RunFile, AbortedRunsKeepTheirReasonAndNeverReplaceEachOther) {
  run.outcome = Outcome::aborted;
  run.outcome_reason = "coil temperature above 80 °C";
  write_run(path, run);
  write_run(path, run);
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_TRUE(std::filesystem::exists(folder / "a.aborted-2.h5"));
  const RunRecording again = read_run(folder / "a.aborted.h5");
  EXPECT_EQ(again.outcome, Outcome::aborted);
  EXPECT_EQ(again.outcome_reason, run.outcome_reason);
  EXPECT_TRUE(verify_run(folder / "a.aborted.h5").whole());
}

TEST_F(RunFile, DestructorLeavesAReadablePart) {
  run.load_cell.erase(run.load_cell.begin() + 1000);
  {
    RunWriter writer(path, run.header);
    write_pieces(writer, run);
  }
  const RunRecording again = read_run(folder / "a.h5.part");
  EXPECT_TRUE(same_rows(run.load_cell, again.load_cell));
  EXPECT_EQ(again.outcome, Outcome::aborted);
  EXPECT_THAT(verify_run(folder / "a.h5.part").problems, Contains(HasSubstr("stopped before the end")));
  LoadCellColumns columns;
  const RunRecording quick = read_run(folder / "a.h5.part", columns);
  EXPECT_EQ(columns.force.size(), again.load_cell.size());
  EXPECT_EQ(again.account.lost_network, 1u);
  EXPECT_EQ(quick.account.lost_network, 1u);
  EXPECT_EQ(quick.account.expected, again.account.expected);
}

TEST_F(RunFile, ReadsAThrustAxisThatIsNoneAsTheNearest) {
  run.header.thrust_axis = 100'000;
  {
    RunWriter writer(path, run.header);
    write_pieces(writer, run);
  }
  LoadCellColumns columns;
  (void)read_run(folder / "a.h5.part", columns);
  ASSERT_EQ(columns.force.size(), run.load_cell.size());
  EXPECT_EQ(columns.force.front(), run.load_cell.front().counts[2]);
  EXPECT_EQ(columns.torque.front(), run.load_cell.front().counts[5]);
}

TEST_F(RunFile, FinishRefusesARunWhoseLossesDoNotAddUp) {
  run.load_cell.erase(run.load_cell.begin() + 1000);
  run.account.received -= 1;
  run.account.expected -= 1;
  EXPECT_THAT(error_of<RecordError>([&] { write_run(path, run); }), HasSubstr("1 missing samples, 0 were counted"));
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_TRUE(std::filesystem::exists(folder / "a.h5.part"));
}

TEST_F(RunFile, WithAnUnknownCodeIsRefused) {
  run.phases[1].phase = static_cast<Phase>(200);
  EXPECT_THAT(error_of<RecordError>([&] { write_run(path, run); }),
              HasSubstr("commands row 1 has the unknown phase 200"));
}

TEST_F(RunFile, WithoutRoomNothingBegins) {
  class Tiny : public FileLayer {
    std::uint64_t free_bytes(const std::filesystem::path&) override { return 1000; }
  } tiny;
  EXPECT_NO_THROW(require_room("/somewhere", 1000, tiny));
  EXPECT_THAT(
      error_of<RecordError>([&] { require_room("/somewhere", RunWriter::bytes_needed(1, 560000, 20000), tiny); }),
      StartsWith("disk full: /somewhere: "));
}

TEST_F(RunFile, BytesNeededAreEnoughButNotFarOff) {
  Truth truth;
  truth.rate_hz = 7000;
  truth.ft_stride = 1;
  run = make_run(truth);
  write_run(path, run);
  const std::uint64_t needed = RunWriter::bytes_needed(1, run.load_cell.size(), run.motor.size());
  EXPECT_GE(needed, std::filesystem::file_size(path));
  EXPECT_LE(needed, 4 * std::filesystem::file_size(path));
  EXPECT_GT(RunWriter::bytes_needed(1, 0, 1'000'000), 24'000'000u) << "readings";
}

}  // namespace kphi::results::run_file_test
