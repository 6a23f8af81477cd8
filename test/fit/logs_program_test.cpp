// Tables of others as a person hands them to kphi: words and exit codes of what is odd about them, and the lines that
// fit/logs/README.md tells to type.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "base/random.hpp"
#include "compensation/units.hpp"
#include "results/file_layer.hpp"
#include "test/end_to_end/process.hpp"
#include "test/source_dir.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace logs_program_test {

using test::Process;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kK = 1.2e-6;
double newtons(double rpm, double k = kK) { return k * std::pow(from_rpm(rpm).value(), 2); }

struct Answer {
  int code = -1;
  std::string out, err;
};

/// In a shell, as a person types it.
Answer typed(const std::filesystem::path& folder, const std::string& line) {
  const std::string program = std::filesystem::path(test::kphi()).parent_path().string();
  Process process({"/bin/bash", "-c", fmt::format("cd '{}' && PATH='{}':$PATH && {}", folder.string(), program, line)});
  const int code = process.wait();
  return {code, process.out(), process.err()};
}

class LogsProgram : public ::testing::Test {
 protected:
  void file(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }
  Answer type(const std::string& line) { return typed(folder_.path(), line); }
  test::TemporaryFolder folder_;
};

/// Rows of a log: `count` of them from low to high RPM, as `line` writes them.
template <class Line>
std::string rows(int count, double low_rpm, double high_rpm, Line line) {
  std::string text;
  for (int i = 0; i < count; ++i) text += line(i, low_rpm + (high_rpm - low_rpm) * i / (count - 1.0));
  return text;
}

/// A ramp of a stand whose channel reads `zero` without thrust.
std::string ramp(double zero, double sign, double noise, double low_rpm, double high_rpm, unsigned seed) {
  Random random(seed);
  return "Time (s);Thrust (N);RPM\n" + rows(300, low_rpm, high_rpm, [&](int i, double rpm) {
           return fmt::format("{:.2f};{:.4f};{:.0f}\n", 0.05 * i, sign * newtons(rpm) + zero + noise * random.normal(),
                              rpm);
         });
}

struct Door {
  const char* what;
  std::string bytes;
  const char* options;
  int code;
  const char* words;
  double k = kK;  ///< of the first table written, with exit 0
};

std::vector<Door> doors() {
  const auto plain = [](int, double rpm) { return fmt::format("{:.0f},{:.5f}\n", rpm, newtons(rpm)); };
  std::vector<Door> all;
  // Lines before the header.
  all.push_back(
      {"comments, a title, a block and a line of units",
       "# stand 3\nStatic test\n\nMotor:,X2207\nDiameter:,5\n\nSpeed,Thrust\nRPM,N\n" + rows(20, 2e3, 2e4, plain), "",
       0, "N/(rad/s)^2"});
  all.push_back({"no header", rows(20, 2e3, 2e4, plain), "", 2, "name the columns by their number"});
  all.push_back({"no header, columns named by number", rows(20, 2e3, 2e4, plain),
                 "--column speed=1:RPM --column thrust=2:N", 0, "N/(rad/s)^2"});
  // Marks.
  all.push_back(
      {"3,000 that may be 3 or 3000",
       "rpm;thrust (N)\n" +
           rows(10, 2, 12, [](int, double k) { return fmt::format("{:.0f},000;{:.0f}\n", k, newtons(1000 * k)); }),
       "", 2, "--decimal"});
  constexpr double kStrong = 4e-6;
  const auto whole_grams = [&](int, double rpm) {
    const int grams = static_cast<int>(newtons(rpm, kStrong) / 9.80665e-3 + 0.5);
    return fmt::format("{:.0f};{};11,5\n", rpm,
                       grams < 1000 ? fmt::format("{}", grams) : fmt::format("{}.{:03}", grams / 1000, grams % 1000));
  };
  const std::string german = "rpm;thrust (g);V\n" + rows(12, 6e3, 2e4, whole_grams);
  all.push_back({"1.171 g among whole grams", german, "", 2, "\"1.171\" can be 1.171 or 1171"});
  all.push_back({"the same, with the mark that was asked for", german, "--decimal comma", 0, "N/(rad/s)^2", kStrong});
  // Directions.
  all.push_back({"two directions in one sweep",
                 "PWM (us),RPM,Force (kgf)\n" + rows(41, 1100, 1900,
                                                     [](int, double pwm) {
                                                       const double u = (pwm - 1500) / 400;
                                                       return fmt::format("{:.0f},{:.0f},{:.4f}\n", pwm,
                                                                          std::abs(u) * 3000, (u > 0 ? 5 : -4) * u * u);
                                                     }),
                 "", 0, "fitted apart", 4 * 9.80665 / std::pow(from_rpm(3000).value(), 2)});
  // Files that are no table.
  all.push_back({"a workbook", "PK\x03\x04 and more", "", 2, "Excel workbook"});
  all.push_back({"a gzip", "\x1f\x8b\x08 and more", "", 2, "gunzip -k FILE"});
  all.push_back(
      {"a flight log", std::string("\x55\x4c\x6f\x67\x01\x12\x35\x01", 8) + "more", "", 2, "flight log of PX4"});
  // Four rotors share the thrust.
  all.push_back({"thrust of four rotors",
                 "thrust (N),rpm1,rpm2,rpm3,rpm4\n" + rows(20, 2e3, 12e3,
                                                           [](int, double rpm) {
                                                             return fmt::format("{:.5f},{:.0f},{:.0f},{:.0f},{:.0f}\n",
                                                                                4 * newtons(rpm), rpm, rpm, rpm, rpm);
                                                           }),
                 "", 0, "thrust is that of all, k that of one"});
  // Thrust always negative.
  all.push_back({"thrust always negative", ramp(0, -1, 0.01, 3000, 12000, 1), "", 2,
                 "its sign is reversed; import with --reverse-thrust"});
  all.push_back({"the same, turned", ramp(0, -1, 0.01, 3000, 12000, 1), "--reverse-thrust", 0, "N/(rad/s)^2"});
  all.push_back({"thrust turned that was right", ramp(0, 1, 0.01, 3000, 12000, 1), "--reverse-thrust", 2,
                 "leave --reverse-thrust out"});
  all.push_back({"no speed at all", "time (s),thrust (N)\n0,1\n1,2\n2,3\n", "", 2, "speed"});
  all.push_back(
      {"electrical speed with `;`",
       "Thrust (N);ERPM\n" +
           rows(20, 2e3, 12e3, [](int, double rpm) { return fmt::format("{:.5f};{:.0f}\n", newtons(rpm), 7 * rpm); }),
       "", 2, "--speed-factor 1/7"});
  // Untared logs without rows of the motor off, whose sum of T ω² is below 0 although thrust rises: 12 of 14.
  int seed = 10;
  for (const auto& [zero, noise, high] :
       {std::tuple(-3.0, 0.01, 9000.0), std::tuple(-5.0, 0.05, 12000.0), std::tuple(-8.0, 0.1, 14000.0),
        std::tuple(-2.0, 0.02, 8000.0), std::tuple(-12.0, 0.08, 16000.0), std::tuple(-20.0, 0.05, 20000.0)})
    all.push_back(
        {"untared far below 0", ramp(zero, 1, noise, 3000, high, static_cast<unsigned>(++seed)), "", 0, "zero_fitted"});
  for (const auto& [zero, low, high] :
       {std::tuple(-4.0, 6000.0, 6600.0), std::tuple(-2.5, 5000.0, 5300.0), std::tuple(-4.0, 9000.0, 9900.0)})
    all.push_back(
        {"untared, at nearly one speed", ramp(zero, 1, 0.05, low, high, static_cast<unsigned>(++seed)), "", 5, "zero"});
  for (const double noise : {2.0, 4.0, 8.0})
    all.push_back(
        {"untared, drowned in noise", ramp(-3, 1, noise, 3000, 5000, static_cast<unsigned>(++seed)), "", 5, "zero"});
  // And two that are reversed indeed.
  for (const double zero : {1.0, -1.0})
    all.push_back({"reversed and untared", ramp(zero, -1, 0.01, 3000, 12000, static_cast<unsigned>(++seed)), "", 2,
                   "import with --reverse-thrust"});
  for (const double zero : {1.0, -1.0})
    all.push_back({"reversed and untared, turned", ramp(zero, -1, 0.01, 3000, 12000, static_cast<unsigned>(++seed)),
                   "--reverse-thrust", 0, "zero_fitted"});
  // "k may be off by a few percent", where it was off by 1.6 to 3.9 times.
  for (const double zero : {1.2, 3.0, 6.0})
    all.push_back(
        {"untared above 0", ramp(zero, 1, 0.02, 2500, 9000, static_cast<unsigned>(++seed)), "", 0, "zero_fitted"});
  return all;
}

TEST_F(LogsProgram, TellsOfEachDoorWithItsExitCode) {
  int number = 0;
  for (const Door& door : doors()) {
    const std::string name = fmt::format("log{}", ++number);
    file(name + ".csv", door.bytes);
    const Answer answer = type(fmt::format("kphi import {}.csv --out tables {}", name, door.options));
    EXPECT_EQ(answer.code, door.code) << door.what << " (" << name << "): " << answer.err << answer.out;
    EXPECT_THAT(answer.out + answer.err, HasSubstr(door.words)) << door.what << " (" << name << ")";
    if (answer.code != 0) continue;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "tables")) {
      if (!entry.path().filename().string().starts_with(name)) continue;
      if (door.bytes.find("Force") != std::string::npos && !entry.path().string().ends_with("reverse")) continue;
      const auto record = nlohmann::json::parse(results::read_text(entry.path() / "import.json"));
      EXPECT_NEAR(record.at("k_n_s2_per_rad2").get<double>() / door.k, 1, 0.05) << door.what << ": " << answer.err;
    }
  }
}

/// 30 logs of one propeller as a German stand writes them, with throttle and voltage.
void write_thirty(const std::filesystem::path& folder) {
  for (int log = 1; log <= 30; ++log) {
    Random random(static_cast<std::uint64_t>(log));
    std::ofstream out(folder / fmt::format("messung{:02}.csv", log));
    const double k = kK * (1 + 0.01 * random.normal()), fastest = 17000 + 100 * (log % 7);
    std::string text = "# Prüfstand 3\nZeit [s];Gas [%];Drehzahl [1/min];Schub [N];Drehmoment [N·m];Spannung [V]\n";
    for (int i = 0; i < 60; ++i) {
      const double u = 0.1 + 0.9 * (i / 3) / 19.0, share = 0.4 * u * u + 0.6 * u, rpm = fastest * std::sqrt(share);
      const double thrust = newtons(rpm, k) + 0.01 * random.normal();
      text += fmt::format("{:.1f};{:.1f};{:.0f};{:.4f};{:.5f};{:.2f}\n", 0.5 * i, 100 * u, rpm, thrust, 0.012 * thrust,
                          12 - 0.6 * u);
    }
    std::ranges::replace(text, '.', ',');
    out << text;
  }
}

/// The lines behind "A folder of logs of one kind".
std::vector<std::string> lines_of_readme() {
  const std::string text = results::read_text(test::source_dir() + "/fit/logs/README.md");
  std::istringstream rest(text.substr(text.find("A folder of logs of one kind")));
  std::vector<std::string> lines;
  for (std::string line; std::getline(rest, line);) {
    if (line.starts_with("    ")) lines.push_back(line.substr(4));
    if (!lines.empty() && line.empty()) break;
  }
  return lines;
}

TEST_F(LogsProgram, DoesWhatItsReadmeTellsToType) {
  write_thirty(folder_.path());
  const std::vector<std::string> lines = lines_of_readme();
  ASSERT_GE(lines.size(), 8u);
  std::map<std::string, Answer> answers;
  for (const std::string& line : lines) {
    const Answer answer = type(line);
    EXPECT_EQ(answer.code, 0) << line << "\n" << answer.err;
    answers[line.substr(0, line.find('#'))] = answer;
  }
  const auto answer_of = [&](const std::string& begin) {
    for (const auto& [line, answer] : answers)
      if (line.starts_with(begin)) return answer;
    ADD_FAILURE() << "no line " << begin;
    return Answer{};
  };
  EXPECT_THAT(answer_of("kphi list").out, AllOf(HasSubstr("messung01"), HasSubstr("messung30")));
  const std::string table = answer_of("kphi compare").out;
  EXPECT_THAT(table, AllOf(HasSubstr("messung30"), HasSubstr("which all reached"), HasSubstr("the logs scatter by")));
  EXPECT_THAT(results::read_text(folder_ / "all.html"), AllOf(HasSubstr("messung07"), HasSubstr("<svg")));
  EXPECT_THAT(results::read_text(folder_ / "own.params"),
              AllOf(HasSubstr("CA_ROTOR3_CT"), testing::ContainsRegex("THR_MDL_FAC\t0\\.(39|40)")));
  EXPECT_THAT(answer_of("kphi export tables/messung01 --to betaflight").out, HasSubstr("set thrust_linear = "));
}

TEST_F(LogsProgram, ComparesLogsInStandardAirWhereTheDensityIsKnown) {
  for (const auto& [name, density] : {std::pair("thin", 1.10), std::pair("thick", 1.25), std::pair("between", 1.18)}) {
    file(std::string(name) + ".csv", "rpm,thrust (N)\n" + rows(30, 4000, 15000, [density = density](int, double rpm) {
                                       return fmt::format("{:.0f},{:.6f}\n", rpm, density / 1.225 * newtons(rpm));
                                     }));
    const Answer answer =
        type(fmt::format("kphi import {}.csv --out tables --tared --air-density-kg-m3 {}", name, density));
    ASSERT_EQ(answer.code, 0) << answer.err;
  }
  const auto found = nlohmann::json::parse(type("kphi compare tables/*/ --json").out);
  ASSERT_EQ(found.at("logs").size(), 3u);
  for (const auto& log : found.at("logs")) EXPECT_NEAR(log.at("K_T").get<double>() / kK, 1, 1e-5) << log.dump();
  EXPECT_LT(found.at("spread").get<double>(), 1e-5);
  EXPECT_THAT(found.at("remarks").dump(), HasSubstr("in standard air"));
}

}  // namespace logs_program_test
}  // namespace kphi::fit
