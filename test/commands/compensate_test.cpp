#include "commands/compensate.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <sstream>
#include <streambuf>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/number.hpp"
#include "profiles/vehicle.hpp"
#include "test/compensation/example_vehicle.hpp"
#include "test/source_dir.hpp"

namespace kphi::commands::compensate_test {

using namespace compensation;

using namespace testing;

const std::string kHeader = "theta1_deg,theta2_deg,theta3_deg,theta4_deg,thrust1_n,thrust2_n,thrust3_n,thrust4_n\n";
const std::string kOutputHeader =
    "phi1_deg,phi2_deg,phi3_deg,phi4_deg,k1,k2,k3,k4,speed1_rpm,speed2_rpm,speed3_rpm,speed4_rpm,flags\n";

std::vector<std::string> split_words(const std::string& csv) {
  std::vector<std::string> fields(1);
  for (const char c : csv.substr(0, csv.size() - 1)) c == ',' || c == '\n' ? fields.emplace_back() : fields.back() += c;
  return fields;
}

struct Result {
  RowCounts counts;
  std::string output;
  std::string words;
};

Result compensated(const std::string& input, RowFormat format = RowFormat::csv) {
  std::istringstream in(input);
  std::ostringstream out, words;
  Compensator compensator = example_compensator();
  Result result;
  result.counts = compensate_rows(in, out, words, compensator, format);
  result.output = out.str();
  result.words = words.str();
  return result;
}

TEST(CompensateRows, WritesOcclusionsFactorsAndSpeeds) {
  const Result result = compensated(kHeader + "45,45,45,180,1.7,0,1.7,1.7\n");
  EXPECT_EQ(result.counts.written, 1u);
  EXPECT_EQ(result.counts.rejected, 0u);
  EXPECT_EQ(result.words, "");
  EXPECT_THAT(result.output, StartsWith(kOutputHeader + "0,0,0,64.83"));
  EXPECT_THAT(result.output, HasSubstr(",1,1,1,0.84269"));
  EXPECT_THAT(result.output, HasSubstr(",10000,0,10000,10893."));
  EXPECT_EQ(result.output.substr(result.output.size() - 2), ",\n") << "no flags";
}

TEST(CompensateRows, TellsFlagsByRotor) {
  const Result result = compensated(kHeader + "45,45,45,45,-1,1,99,1\n");
  EXPECT_THAT(result.output, HasSubstr(",1:thrust_negative 3:speed_at_fastest\n"));
}

TEST(CompensateRows, WritesOneJsonObjectPerLineIfAsked) {
  const Result result = compensated(kHeader + "45,45,45,45,1.7,0,1.7,99\n45,45,45,45,0,0,0,0\n", RowFormat::json_lines);
  EXPECT_THAT(result.output, StartsWith("{\"phi_deg\":[0,0,0,0],\"k\":[1,1,1,1],\"speed_rpm\":["));
  EXPECT_THAT(result.output, HasSubstr("],\"flags\":[\"4:speed_at_fastest\"]}\n{\"phi_deg\""));
  EXPECT_THAT(result.output, HasSubstr("\"speed_rpm\":[0,0,0,0],\"flags\":[]}\n"));
}

TEST(CompensateRows, FindsColumnsByNameAndIgnoresOthers) {
  const Result plain = compensated(kHeader + "1,2,3,170,5,6,7,8\n");
  const Result moved = compensated(
      "time_s,thrust4_n,thrust3_n,thrust2_n,thrust1_n,theta4_deg,theta3_deg,theta2_deg,theta1_deg,note\n"
      "0.1,8,7,6,5,170,3,2,1,words\n");
  EXPECT_EQ(moved.output, plain.output);
}

TEST(CompensateRows, TakesWindowsLinesByteOrderMarksBlanksAndAMissingLastNewline) {
  const Result plain = compensated(kHeader + "1,2,3,170,5,6,7,8\n");
  std::string header = kHeader;
  header.insert(header.size() - 1, "\r");
  EXPECT_EQ(compensated("\xEF\xBB\xBF" + header + "\r\n 1, 2 ,3,170,5,6,7,8\r").output, plain.output);
}

TEST(CompensateRows, LeavesOutBadRowsAndNamesThemByLine) {
  const Result result = compensated(kHeader +
                                    "45,45,45,45,1,1,1,1\n"
                                    "45,45,45,1,1,1,1\n"
                                    "45,45,45,45,1,much,1,1\n"
                                    "\n"
                                    "45,nan,45,45,1,1,1,1\n"
                                    "45,45,45,45,1,1,1,inf\n"
                                    "45,45,45,45,1,1,1,\n"
                                    "45,45,45,45,1,1,1,1 N\n"
                                    "45,45,45,45,1,1,1,2\n");
  EXPECT_EQ(result.counts.written, 2u);
  EXPECT_EQ(result.counts.rejected, 6u);
  EXPECT_THAT(result.words, StartsWith("stdin:3: has 7 fields where the header has 8; row skipped\n"
                                       "stdin:4: thrust2_n is \"much\", not a finite number; row skipped\n"
                                       "stdin:6: theta2_deg is \"nan\""));
  EXPECT_THAT(result.words, HasSubstr("stdin:9: thrust4_n is \"1 N\""));
}

TEST(CompensateRows, RefusesAHeaderWithoutAllColumns) {
  for (const std::string& bad :
       {std::string(), std::string("1,2,3,4,5,6,7,8\n"), kHeader.substr(11), "theta1_deg," + kHeader}) {
    EXPECT_THROW(compensated(bad), ConfigurationError) << bad;
  }
}

/// Never ends a line.
class OneByte : public std::streambuf {
  int_type underflow() override {
    setg(&byte_, &byte_, &byte_ + 1);
    return traits_type::to_int_type(byte_);
  }
  char byte_ = '\0';
};

TEST(CompensateRows, RefusesAStreamThatNeverEndsALine) {
  OneByte zeros;
  std::istream in(&zeros);
  std::ostringstream out, words;
  Compensator compensator = example_compensator();
  EXPECT_THROW((void)compensate_rows(in, out, words, compensator, RowFormat::csv), ConfigurationError);
}

TEST(CompensateRows, SaysWhatIsWrongWithTheHeader) {
  const auto complaint = [](const std::string& header) -> std::string {
    try {
      (void)compensated(header + "\n1,2,3,4,5,6,7,8\n");
    } catch (const ConfigurationError& error) {
      return error.what();
    }
    return "";
  };
  const std::string rest = "theta2_deg,theta3_deg,theta4_deg,thrust1_n,thrust2_n,thrust3_n,thrust4_n";
  EXPECT_THAT(complaint(""), StartsWith("stdin:1: no header; the first line must name theta1_deg..theta4_deg"));
  EXPECT_THAT(complaint(rest), StartsWith("stdin:1: column `theta1_deg` is missing; the first line must name"));
  EXPECT_THAT(complaint("theta1_rad," + rest),
              StartsWith("stdin:1: column `theta1_deg` is missing, but there is \"theta1_rad\"; convert it"));
  EXPECT_THAT(complaint("theta1_deg,thrust1_n," + rest), StartsWith("stdin:1: column `thrust1_n` appears 2 times"));
}

TEST(CompensateRows, CountsRowsWithAnArmWhereNoServoGoes) {
  const Result result = compensated(kHeader + "45,45,45,45,1,1,1,1\n45,45,200,-101,1,1,1,1\n45,45,45,180,1,1,1,1\n");
  EXPECT_EQ(result.counts.written, 3u) << "180° is the end of the range and in it";
  EXPECT_EQ(result.counts.out_of_reach, 1u);
  EXPECT_THAT(result.output, HasSubstr(",3:arm_angle_beyond 4:arm_angle_beyond\n"));
}

/// Six arms by their angles, and the same hubs by their places: nothing but rounding is between them.
TEST(CompensateRows, OfSixHubsAreThoseOfSixArms) {
  const profiles::Vehicle vehicle = profiles::load_vehicle(test::source_dir() + "/profiles/foldable_hexa.yaml");
  const Airframe airframe = profiles::airframe_of(vehicle);
  const auto rows = [&](const std::string& header, const std::string& lines, RowShape shape) {
    Compensator compensator = *Compensator::build(Rotors<ThrustCurve>(6, paper_line()), airframe).compensator;
    std::istringstream in(header + lines);
    std::ostringstream out, words;
    const RowCounts counts = compensate_rows(in, out, words, compensator, RowFormat::csv, shape);
    EXPECT_EQ(counts.written, 200u) << words.str();
    return split_words(out.str());
  };
  std::string by_arms, by_hubs, arms_header, hubs_header;
  for (int i = 1; i <= 6; ++i) {
    arms_header += fmt::format("theta{}_deg,", i);
    hubs_header += fmt::format("hub{0}_x_m,hub{0}_y_m,", i);
  }
  const std::string thrusts = "thrust1_n,thrust2_n,thrust3_n,thrust4_n,thrust5_n,thrust6_n\n";
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> angles(0, 180), newtons(0, 7);
  for (int row = 0; row < 200; ++row) {
    std::string asked;
    for (std::size_t i = 0; i < 6; ++i) {
      const double angle = angles(random);
      const HubPosition hub = hub_in_body(airframe, i, from_degrees(angle));
      by_arms += fmt::format("{},", angle);
      by_hubs += fmt::format("{},{},", hub.x.value(), hub.y.value());
      asked += fmt::format("{}{}", newtons(random), i == 5 ? "\n" : ",");
    }
    by_arms += asked;
    by_hubs += asked;
  }
  const auto arms = rows(arms_header + thrusts, by_arms, RowShape::arms);
  const auto hubs = rows(hubs_header + thrusts, by_hubs, RowShape::hubs);
  EXPECT_THAT(arms[0], "phi1_deg");
  ASSERT_EQ(arms.size(), hubs.size());
  ASSERT_EQ(arms.size(), 201u * 19);
  int covered = 0;
  for (std::size_t i = 0; i < arms.size(); ++i) {
    const auto a = parse_finite(arms[i]), b = parse_finite(hubs[i]);
    if (!a || !b) {
      ASSERT_EQ(arms[i], hubs[i]) << "names and flags";
      continue;
    }
    ASSERT_NEAR(*a, *b, 1e-6 + 1e-9 * std::fabs(*a)) << "field " << i % 19 << " of line " << i / 19;
    covered += i % 19 < 6 && *a > 0;
  }
  EXPECT_GT(covered, 100);
}

TEST(CompensateRows, OfAHeaderAloneIsAHeaderAlone) { EXPECT_EQ(compensated(kHeader).output, kOutputHeader); }

/// A source that hands out one line at a time and looks, at each, at what has come out so far.
class OneLineAtATime : public std::streambuf {
 public:
  OneLineAtATime(std::vector<std::string> lines, const std::ostringstream& out) : lines_(std::move(lines)), out_(out) {}
  std::vector<std::size_t> output_sizes;

 protected:
  int_type underflow() override {
    output_sizes.push_back(out_.str().size());
    if (next_ == lines_.size()) return traits_type::eof();
    std::string& line = lines_[next_++];
    setg(line.data(), line.data(), line.data() + line.size());
    return traits_type::to_int_type(line[0]);
  }

 private:
  std::vector<std::string> lines_;
  const std::ostringstream& out_;
  std::size_t next_ = 0;
};

TEST(CompensateRows, HandsARowOnBeforeWaitingForTheNext) {
  std::ostringstream out, words;
  OneLineAtATime source({kHeader, "1,2,3,170,5,6,7,8\n", "1,2,3,170,5,6,7,9\n"}, out);
  std::istream in(&source);
  Compensator compensator = example_compensator();
  (void)compensate_rows(in, out, words, compensator, RowFormat::csv);
  ASSERT_EQ(source.output_sizes.size(), 4u);
  EXPECT_GT(source.output_sizes[2], kOutputHeader.size());
  EXPECT_GT(source.output_sizes[3], source.output_sizes[2]);
}

}  // namespace kphi::commands::compensate_test
