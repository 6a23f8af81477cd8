#include "fit/logs/layout.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <set>

#include "base/error.hpp"
#include "base/random.hpp"
#include "compensation/units.hpp"
#include "fit/logs/stand_log.hpp"
#include "test/refusal.hpp"

namespace kphi::fit {
namespace layout_test {

using ::testing::AnyOf;
using ::testing::HasSubstr;

/// Uniform from 0 to 1.
double share_of(Random& random) { return (random.symmetric() + 1) / 2; }

std::string refusal(std::string_view text, const LayoutHints& hints = {}) {
  try {
    (void)read_log(text, "own.csv", hints);
  } catch (const ConfigurationError& error) {
    return error.what();
  }
  return "read";
}

// ---- a writer of tables, which knows nothing of the reader ---------------------------------------------------

/// A number with that many decimals, as a locale writes it.
std::string written(double value, int decimals, char decimal, const std::string& grouping) {
  std::string text = fmt::format("{:.{}f}", std::abs(value), decimals);
  std::string whole = text.substr(0, text.find('.')),
              rest = text.find('.') == std::string::npos ? "" : text.substr(text.find('.') + 1);
  for (int at = static_cast<int>(whole.size()) - 3; at > 0 && !grouping.empty(); at -= 3)
    whole.insert(static_cast<std::size_t>(at), grouping);
  return (value < 0 ? "-" : "") + whole + (rest.empty() ? "" : std::string(1, decimal) + rest);
}

std::string encoded(const std::string& utf8, int encoding) {
  if (encoding == 0) return utf8;
  if (encoding == 1) return "\xEF\xBB\xBF" + utf8;
  std::string bytes = encoding == 2 ? "\xFF\xFE" : "";
  for (std::size_t i = 0; i < utf8.size(); ++i) {
    unsigned c = static_cast<unsigned char>(utf8[i]);
    if (c >= 0xE0u)
      c = (c & 0xFu) << 12u | (static_cast<unsigned char>(utf8[i + 1]) & 0x3Fu) << 6u |
          (static_cast<unsigned char>(utf8[i + 2]) & 0x3Fu),
      i += 2;
    else if (c >= 0xC0u)
      c = (c & 0x1Fu) << 6u | (static_cast<unsigned char>(utf8[i + 1]) & 0x3Fu), i += 1;
    bytes += static_cast<char>(c & 0xFFu);
    if (encoding == 2) bytes += static_cast<char>(c >> 8u);
  }
  return bytes;
}

struct UnitOfTest {
  const char* name;
  double inside;  ///< of one of it, as the library converts it
  double scale;   ///< true value in N, RPM → written number
  int decimals;
};

struct Truth {
  double thrust = 0, rpm = 0, time = 0, throttle_us = 0, volts = 0;
  std::string propeller;
};

struct Written {
  std::string text;
  std::vector<Truth> rows;  ///< as the numbers in the text say, in the units inside
  bool plain = true;        ///< a person reads it without doubt
  std::string words;        ///< of a refusal that is true, where it is not plain
  std::string what;         ///< for a failure
};

/// One table of T = k ω², written in a way that the seed picks.
Written table_of(std::uint64_t seed) {
  Random random(seed);
  const auto pick = [&](std::size_t n) {
    return static_cast<std::size_t>(share_of(random) * static_cast<double>(n)) % n;
  };
  const auto chance = [&](double share) { return share_of(random) < share; };
  Written table;
  const char separators[]{',', ';', '\t', '|', ' '};
  const char separator = separators[pick(5)];
  const bool comma = separator != ',' && chance(0.4);
  const char decimal = comma ? ',' : '.';
  const std::vector<std::string> groupings = separator == ' ' ? std::vector<std::string>{""}
                                             : comma          ? std::vector<std::string>{"", "", ".", " ", "\xC2\xA0"}
                                             : separator == ','
                                                 ? std::vector<std::string>{"", "", "", "'"}
                                                 : std::vector<std::string>{"", "", ",", "'", "\xE2\x80\xAF"};
  const std::string grouping = groupings[pick(groupings.size())];
  const int encoding = grouping == "\xE2\x80\xAF" ? static_cast<int>(pick(3)) : static_cast<int>(pick(4));
  const UnitOfTest thrusts[]{{"N", 1, 1, 4},
                             {"g", from_gram_force(1).value(), 1 / 9.80665e-3, 1},
                             {"gf", from_gram_force(1).value(), 1 / 9.80665e-3, 2},
                             {"kgf", 1000 * from_gram_force(1).value(), 1 / 9.80665, 5},
                             {"lbf", 4.4482216152605, 1 / 4.4482216152605, 5},
                             {"mN", 1e-3, 1e3, 0}};
  const UnitOfTest speeds[]{{"RPM", 1, 1, 0},
                            {"rpm", 1, 1, 1},
                            {"1/min", 1, 1, 0},
                            {"rad/s", 1 / kRadPerSecPerRpm, kRadPerSecPerRpm, 3},
                            {"Hz", 60, 1.0 / 60, 3}};
  const UnitOfTest thrust = thrusts[pick(6)], speed = speeds[pick(5)];
  struct ColumnOfTest {
    std::string name, unit;
    int what;  ///< 0 thrust, 1 speed, 2 time, 3 throttle, 4 voltage, 5 propeller, 6 note, 7 power
  };
  const std::vector<std::string> thrust_names{"Thrust",  "thrust",           "Schub", "Force",
                                              "Poussée", "Propeller thrust", "Load"},
      speed_names{"Motor speed", "Drehzahl", "rotor speed", "Speed", "n", "Rotational Speed", "omega"};
  std::vector<ColumnOfTest> columns{{thrust_names[pick(thrust_names.size())], thrust.name, 0},
                                    {speed_names[pick(speed_names.size())], speed.name, 1}};
  const int throttle_kind = static_cast<int>(pick(3));
  if (chance(0.6)) columns.push_back({chance(0.5) ? "Time" : "Zeit", chance(0.7) ? "s" : "ms", 2});
  if (chance(0.5))
    columns.push_back({chance(0.5) ? "Throttle" : "ESC signal",
                       throttle_kind == 0   ? "us"
                       : throttle_kind == 1 ? "%"
                                            : "0..1",
                       3});
  if (chance(0.5)) columns.push_back({chance(0.5) ? "Voltage" : "Spannung", "V", 4});
  const bool groups = chance(0.3);
  if (groups) columns.push_back({chance(0.5) ? "Propeller" : "prop", "", 5});
  if (chance(0.3)) columns.push_back({"Electrical power", "W", 7});
  if (chance(0.2) && separator != ' ') columns.push_back({"Note", "", 6});
  for (std::size_t i = columns.size(); i-- > 1;) std::swap(columns[i], columns[pick(i + 1)]);

  const std::string line_end = chance(0.3) ? "\r\n" : "\n";
  std::string text;
  const auto fields = [&](const std::vector<std::string>& parts) {
    std::string line;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const bool quoted = parts[i].find(separator) != std::string::npos && separator != ' ';
      line += (i == 0 ? "" : std::string(1, separator)) + (quoted ? "\"" + parts[i] + "\"" : parts[i]);
    }
    return line + line_end;
  };
  const bool trailing = separator != ' ' && chance(0.15);
  const std::size_t preamble = pick(6);
  if (preamble == 1) text += "# stand 3 of the lab" + line_end + "# 2024-05-01" + line_end;
  if (preamble == 2) text += "Static test of a propeller" + line_end + line_end;
  if (preamble == 3) text += fields({"Motor:", "X2207"}) + fields({"Diameter:", "5"}) + line_end;
  if (preamble == 4) text += "% made by the stand" + line_end;
  const std::size_t units = pick(4);  // in brackets, in square ones, in a line of their own, behind a '_'
  const std::size_t names = chance(0.06) ? 1 : chance(0.06) ? 2 : 0;  // 1: no names; 2: no unit of the thrust
  std::vector<std::string> header, below;
  for (const ColumnOfTest& column : columns) {
    const bool unit = !column.unit.empty() && !(names == 2 && column.what == 0);
    std::string name = column.name;
    if (separator == ' ') std::replace(name.begin(), name.end(), ' ', '_');
    header.push_back(name + (!unit || units == 2 ? ""
                             : units == 0        ? " (" + column.unit + ")"
                             : units == 1        ? " [" + column.unit + "]"
                                                 : "_" + column.unit));
    below.push_back(unit ? column.unit : separator == ' ' ? "-" : "");
  }
  if (names != 1) text += fields(header);
  if (trailing && names != 1) text.insert(text.size() - line_end.size(), 1, separator);
  if (units == 2 && names != 1) text += fields(below);
  table.plain = names == 0;
  table.words = names == 1 ? "name the columns by their number" : "no unit given for column";
  const auto as_number = [&](double value, int decimals, double* back) {
    const std::string number = written(value, decimals, decimal, grouping);
    *back = std::strtod(fmt::format("{:.{}f}", value, decimals).c_str(), nullptr);
    return number;
  };
  const int rows = 12 + static_cast<int>(pick(60));
  for (int i = 0; i < rows; ++i) {
    const double rpm = 1000 + 15000.0 * i / rows + share_of(random),
                 newtons = 1.3e-6 * std::pow(rpm * kRadPerSecPerRpm, 2);
    Truth truth;
    std::vector<std::string> parts;
    for (const ColumnOfTest& column : columns) {
      double number = 0;
      switch (column.what) {
        case 0:
          parts.push_back(as_number(newtons * thrust.scale, thrust.decimals, &number));
          truth.thrust = number * thrust.inside;
          break;
        case 1:
          parts.push_back(as_number(rpm * speed.scale, speed.decimals, &number));
          truth.rpm = number * speed.inside;
          break;
        case 2:
          parts.push_back(as_number(column.unit == "s" ? 0.25 * i : 250.0 * i, column.unit == "s" ? 2 : 0, &number));
          truth.time = column.unit == "s" ? number : number * 1e-3;
          break;
        case 3: {
          const double share = (i + 1.0) / rows;
          parts.push_back(as_number(throttle_kind == 0   ? 1000 + 1000 * share
                                    : throttle_kind == 1 ? 100 * share
                                                         : share,
                                    throttle_kind == 0   ? 0
                                    : throttle_kind == 1 ? 1
                                                         : 4,
                                    &number));
          truth.throttle_us = throttle_kind == 0   ? number
                              : throttle_kind == 1 ? number * 10 + 1000
                                                   : number * 1000 + 1000;
          break;
        }
        case 4:
          parts.push_back(as_number(12 - 0.01 * i, 2, &number));
          truth.volts = number;
          break;
        case 5:
          truth.propeller = i < rows / 2 ? "5x3" : "5x4.5";
          parts.push_back(truth.propeller);
          break;
        case 6:
          parts.push_back(i % 7 == 3 ? "look" : "");
          break;
        default:
          parts.push_back(as_number(5.5 + i, 1, &number));
          break;
      }
    }
    table.rows.push_back(truth);
    text += fields(parts);
    if (trailing) text.insert(text.size() - line_end.size(), 1, separator);
  }
  if (chance(0.2)) text.resize(text.size() - line_end.size());
  table.text = encoded(text, encoding);
  table.what = fmt::format("seed {}, encoding {}\n{}", seed, encoding, text.substr(0, 500));
  return table;
}

enum class Outcome { right, refused, wrong };

Outcome outcome_of(const Written& table, std::string& why) {
  StandLog log;
  try {
    log = read_log(table.text, "own.csv");
  } catch (const ConfigurationError& error) {
    why = error.what();
    return Outcome::refused;
  }
  if (log.rows.size() != table.rows.size()) {
    why = fmt::format("{} of {} rows", log.rows.size(), table.rows.size());
    return Outcome::wrong;
  }
  const auto same = [](const Reading& reading, double value) { return !reading || *reading == value; };
  for (std::size_t i = 0; i < log.rows.size(); ++i) {
    const StandRow& row = log.rows[i];
    const Truth& truth = table.rows[i];
    const bool right = row.thrust_n == truth.thrust && row.optical_rpm == truth.rpm && same(row.time_s, truth.time) &&
                       same(row.throttle_us, truth.throttle_us) && same(row.voltage_v, truth.volts) &&
                       log.groups[row.group] == truth.propeller;
    why = fmt::format("row {}: {} N for {} N, {} RPM for {} RPM, {} for {} us, group {}", i, row.thrust_n, truth.thrust,
                      *row.optical_rpm, truth.rpm, row.throttle_us.value_or(-1), truth.throttle_us,
                      log.groups[row.group]);
    if (!right) return Outcome::wrong;
  }
  return Outcome::right;
}

/// KPHI_LAYOUTS: how many.
TEST(RandomLayouts, AreReadToTheLastBitOrRefusedWithTheReason) {
  const char* const more = std::getenv("KPHI_LAYOUTS");
  const std::uint64_t count = more == nullptr ? 200 : std::strtoull(more, nullptr, 10);
  std::size_t plain = 0, read = 0;
  for (std::uint64_t seed = 1; seed <= count; ++seed) {
    const Written table = table_of(seed);
    std::string why;
    const Outcome outcome = outcome_of(table, why);
    EXPECT_NE(outcome, Outcome::wrong) << why << "\n" << table.what;
    if (!table.plain) {
      EXPECT_THAT(why, AnyOf(HasSubstr(table.words), HasSubstr("no column is surely the"))) << table.what;
      continue;
    }
    ++plain;
    read += outcome == Outcome::right ? 1 : 0;
    if (outcome == Outcome::refused) fmt::print("refused: {}\n{}\n", why, table.what);
  }
  fmt::print("{} of {} tables that a person reads without doubt were read without an option\n", read, plain);
  EXPECT_GE(static_cast<double>(read), 0.95 * static_cast<double>(plain));
}

// ---- one at a time ------------------------------------------------------------------------------------------

TEST(Layout, IsTheSameOnceItWasWrittenDown) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Written table = table_of(seed);
    if (!table.plain) continue;
    const StandLog log = read_log(table.text, "own.csv");
    const Layout again = parse_layout(layout_text(log.layout), "layout.yaml");
    EXPECT_EQ(layout_text(again), layout_text(log.layout)) << table.what;
    const StandLog by_file = read_log(table.text, "own.csv", again);
    ASSERT_EQ(by_file.rows.size(), log.rows.size()) << table.what;
    for (std::size_t i = 0; i < log.rows.size(); ++i) ASSERT_EQ(by_file.rows[i].thrust_n, log.rows[i].thrust_n);
  }
}

TEST(Layout, OfAnotherTableIsRefused) {
  const StandLog log = read_log("Thrust (N),n (rpm)\n1,1000\n2,1500\n", "a.csv");
  try {
    (void)read_log("n (rpm),Thrust (N)\n1000,1\n1500,2\n", "b.csv", log.layout);
    FAIL() << "columns are swapped";
  } catch (const ConfigurationError& error) {
    EXPECT_THAT(
        error.what(),
        HasSubstr("b.csv:1: column 2 is \"Thrust (N)\", but \"n (rpm)\" by the layout; this table has another layout"));
  }
}

TEST(Layout, FileWithAFaultIsRefusedAtItsPlace) {
  const std::string good = layout_text(read_log("Thrust (N),n (rpm)\n1,1000\n2,1500\n", "a.csv").layout);
  const auto broken = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return kphi::refusal([&] { return parse_layout(text, "l.yaml"); });
  };
  EXPECT_THAT(broken("unit: 'N'", "unit: 'stone'"), HasSubstr("no unit of thrust"));
  EXPECT_THAT(broken("fields: 2", "fields: 1"), HasSubstr("fields"));
  EXPECT_THAT(broken("role: thrust", "role: torque"), HasSubstr("columns"));
}

struct MarkCase {
  const char* rows;
  const char* words;
};

TEST(Marks, ThatCanBeReadInTwoWaysAreAskedFor) {
  for (const MarkCase& one :
       {MarkCase{"3,000;12\n6,000;47\n", "\"3,000\" can be 3000 or 3: no number of the table tells"},
        {"3000;1.080\n6000;4.320\n", "\"1.080\" can be 1.08 or 1080"},
        {"3000;1,5\n6000;2.5\n", "\"2.5\" (line 3) has a decimal point and \"1,5\" (line 2) a decimal comma"}}) {
    const std::string why = refusal(std::string("rpm;thrust (g)\n") + one.rows);
    EXPECT_THAT(why, HasSubstr(one.words));
    EXPECT_THAT(why, HasSubstr("--decimal point or --decimal comma"));
  }
  EXPECT_THAT(refusal("rpm;thrust (g)\n3,000;12\n6,000;47\n"), HasSubstr("k would be 1.2e-06 or 1.2 N/(rad/s)^2"));
}

TEST(Marks, AreReadAsOtherNumbersOfTheTableTell) {
  const auto first = [](const char* rows, const LayoutHints& hints = {}) {
    const StandLog log = read_log(std::string("rpm;thrust (N);torque (Nm)\n") + rows, "own.csv", hints);
    return std::pair(*log.rows.at(0).optical_rpm, log.rows.at(0).thrust_n);
  };
  EXPECT_EQ(first("3,000;1.08;0.01\n4,000;2.16;0.02\n"), std::pair(3000.0, 1.08));
  EXPECT_EQ(first("3.000;1,08;0,01\n4.000;2,16;0,02\n"), std::pair(3000.0, 1.08));
  EXPECT_EQ(first("3'000;1.08;0.01\n4'000;2.16;0.02\n"), std::pair(3000.0, 1.08));
  EXPECT_EQ(first("3.000;1.080;1\n4.000;2.160;2\n", {.columns = {}, .decimal = ','}), std::pair(3000.0, 1080.0));
  EXPECT_EQ(first("3.000;1.080;1\n4.000;2.160;2\n", {.columns = {}, .decimal = '.'}), std::pair(3.0, 1.08));
}

TEST(Marks, ThatContradictTheOptionAreFound) {
  const StandLog log =
      read_log("rpm;thrust (N)\n3000;1,08\n4000;2.1\n5000;3,24\n", "own.csv", {.columns = {}, .decimal = ','});
  EXPECT_EQ(log.rows.size(), 2u);
  ASSERT_EQ(log.problems.size(), 1u);
  EXPECT_THAT(log.problems[0].what, HasSubstr("thrust \"2.1\" is not a number as the others are written (1234,5)"));
}

TEST(Speeds, OfSeveralRotorsShareTheThrust) {
  const StandLog log =
      read_log("thrust (N),rpm1,rpm2,rpm3,rpm4\n8,3000,3000,3000,3000\n9,3000,4000,3000,4000\n", "own.csv");
  EXPECT_EQ(log.layout.rotors(), 4u);
  EXPECT_EQ(log.rows.at(0).thrust_n, 2);
  EXPECT_NEAR(*log.rows.at(1).optical_rpm, std::sqrt((9e6 + 16e6) / 2), 1e-9);
}

TEST(Speeds, ThatCountElectricalTurnsAreAskedFor) {
  EXPECT_THAT(refusal("Thrust (N),eRPM\n1,21000\n2,28000\n"),
              HasSubstr("for a motor of 14 poles: --column 'electrical_speed=eRPM:RPM' --speed-factor 1/7"));
}

TEST(Columns, ThatCouldBeTheThrustAreAskedFor) {
  EXPECT_THAT(
      refusal("a,b\n1,1000\n2,1500\n"),
      HasSubstr("no column is surely the thrust; name it: --column thrust=HEADER:UNIT; the file has \"a\", \"b\""));
  EXPECT_THAT(refusal("1.5,1000\n2.5,1500\n"),
              HasSubstr("there is no line of names above the rows; name the columns by their number"));
  const StandLog log =
      read_log("1.5,1000\n2.5,1500\n", "own.csv", {.columns = {{Role::thrust, "1", "N"}, {Role::speed, "2", "RPM"}}});
  EXPECT_EQ(log.rows.at(1).thrust_n, 2.5);
  const StandLog numbered = read_log("1,2\n1.5,1000\n2.5,1500\n", "own.csv",
                                     {.columns = {{Role::thrust, "1", "N"}, {Role::speed, "2", "RPM"}}});
  EXPECT_EQ(numbered.rows.size(), 2u) << "names that are numbers are no row";
}

TEST(Fields, OfANamedLastColumnMayAllBeEmpty) {
  const StandLog log = read_log("Thrust (N),n (rpm),App message\n1,1000,\n2,1500,\n", "own.csv");
  EXPECT_EQ(log.rows.size(), 2u);
  EXPECT_EQ(log.layout.fields, 3u);
}

TEST(Fields, WhoseSeparatorIsTheirDecimalMarkAreRefused) {
  EXPECT_THAT(refusal("rpm,thrust (N)\n3000,1,5\n4000,2,7\n5000,3,9\n"),
              HasSubstr("if the comma is the decimal mark as well, export it with another separator"));
}

TEST(Times, OfAClockAreSeconds) {
  const StandLog log = read_log("time,thrust (N),rpm\n12:00:01.5,1,1000\n12:00:02.0,2,1500\n", "own.csv");
  EXPECT_EQ(log.rows.at(1).time_s.value_or(0) - log.rows.at(0).time_s.value_or(0), 0.5);
  const StandLog dated =
      read_log("timestamp,thrust (N),rpm\n2024-05-01T23:59:59Z,1,1000\n2024-05-02T00:00:01Z,2,1500\n", "own.csv");
  EXPECT_EQ(dated.rows.at(1).time_s.value_or(0) - dated.rows.at(0).time_s.value_or(0), 2);
}

TEST(OtherFiles, AreNamedWithWhatToDo) {
  for (const auto& [bytes, words] :
       {std::pair<std::string, const char*>{"PK\x03\x04zzzz", "Excel workbook"},
        {"\x1F\x8B\x08zz", "gunzip -k FILE"},
        {std::string("ULog\x01\x12\x35", 7), "flight log of PX4 (ULog); use `kphi fit FLIGHT --vehicle VEHICLE`"},
        {std::string("\xBC\x01\x00\x02", 4), "flight log of a Crazyflie"},
        {"H Product:Blackbox flight data", "decode it with `blackbox_decode`"},
        {"\x89HDF\r\n\x1A\n", "h5dump"},
        {"PAR1zz", "Parquet"}})
    EXPECT_THAT(refusal(bytes), HasSubstr(words));
}

TEST(OddFiles, AreRefusedInOneLine) {
  const std::string nul("rpm,thrust (N)\n1,2\n\0,3\n", 22);
  EXPECT_THAT(refusal(nul), HasSubstr("own.csv:3: a NUL byte, byte 20 of the file: not a table of text"));
  EXPECT_THAT(refusal(""), HasSubstr("own.csv:1: no line with anything in it"));
  EXPECT_THAT(refusal("hello world, this is no table\n"), HasSubstr("no table"));
  std::string wide = "rpm";
  for (int i = 0; i < 100'000; ++i) wide += ",c" + std::to_string(i);
  const std::string why = refusal(wide + "\n1" + wide.substr(3) + "\n");
  EXPECT_LT(why.size(), 2000u);
  EXPECT_EQ(read_log("rpm,thrust (N)\r1000,1.5\r2000,2.5\r", "own.csv").rows.size(), 2u) << "old line ends";
}

}  // namespace layout_test
}  // namespace kphi::fit
