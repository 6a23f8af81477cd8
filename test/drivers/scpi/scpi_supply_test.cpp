#include "drivers/scpi/scpi_supply.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <vector>

#include "base/error.hpp"
#include "test/drivers/scpi/lent_line.hpp"
#include "test/refusal.hpp"

namespace kphi::scpi {
namespace scpi_supply_test {

using testing::ElementsAre;
using testing::HasSubstr;

/// Answers from a table; remembers what it was told.
class FakeLine final : public Line {
 public:
  std::map<std::string, std::string> answers{{"*IDN?", "KPHI,PS30,SN7,2.1"},
                                             {"VOLT? MAX", "30.0"},
                                             {"CURR? MAX", "10.0"},
                                             {"VOLT?", "12.000"},
                                             {"CURR?", "5.000"},
                                             {"VOLT:PROT?", "13.2"},
                                             {"CURR:PROT?", "6.0"},
                                             {"MEAS:VOLT?", "11.98"},
                                             {"MEAS:CURR?", "1.234"},
                                             {"OUTP?", "0"},
                                             {"SYST:ERR?", "0,\"No error\""},
                                             {"VOLT:PROT:TRIP?", "0"},
                                             {"CURR:PROT:TRIP?", "0"},
                                             {"STAT:QUES:COND?", "1"}};
  std::vector<std::string> told;
  bool obeys = true;

  void write(std::string_view command) override {
    told.emplace_back(command);
    if (!obeys) return;
    if (command == "OUTP ON") answers["OUTP?"] = "1";
    if (command == "OUTP OFF") answers["OUTP?"] = "0";
  }
  std::string query(std::string_view command) override {
    const auto found = answers.find(std::string(command));
    if (found == answers.end()) throw DeviceError(name_, std::string(command), "no answer in time");
    return found->second;
  }
  const std::string& name() const noexcept override { return name_; }

 private:
  std::string name_ = "instrument 10.0.0.9:5025";
};

const supply::Limits kTwelveVolts{Volts(12), Amperes(5), Volts(13.2), Amperes(6)};

class ScpiSupplyTest : public testing::Test {
 protected:
  FakeLine line;
  ManualClock clock;
  std::string refusal(const std::function<void(ScpiSupply&)>& call) {
    return kphi::refusal([&] {
      ScpiSupply supply(lend(line), clock);
      call(supply);
    });
  }
};

TEST_F(ScpiSupplyTest, AsksWhoItIsBeforeAnythingIsWritten) {
  const ScpiSupply supply(lend(line), clock);
  EXPECT_EQ(supply.identity().model, "PS30");
  EXPECT_EQ(supply.identity().serial, "SN7");
  EXPECT_EQ(supply.identity().firmware, "2.1");
  EXPECT_EQ(supply.identity().voltage_max_v, 30);
  EXPECT_TRUE(line.told.empty());
}

TEST_F(ScpiSupplyTest, SetsThresholdsFirstAndReadsAllBack) {
  ScpiSupply supply(lend(line), clock);
  EXPECT_EQ(supply.apply(kTwelveVolts), kTwelveVolts);
  EXPECT_THAT(line.told, ElementsAre("VOLT:PROT 13.200", "VOLT:PROT:STAT ON", "CURR:PROT 6.000", "CURR:PROT:STAT ON",
                                     "CURR 5.000", "VOLT 12.000"));
}

TEST_F(ScpiSupplyTest, SpeaksTheDialectOfTheMaker) {
  line.answers["*IDN?"] = "RIGOL TECHNOLOGIES,DP832,DP8A1,00.01.14";
  line.answers["OUTP:OVP:VAL?"] = "13.2";
  line.answers["OUTP:OCP:VAL?"] = "6";
  line.answers["OUTP:OVP:QUES?"] = "NO";
  line.answers["OUTP:OCP:QUES?"] = "YES";
  line.answers["OUTP:MODE?"] = "CC";
  line.answers["OUTP?"] = "OFF";
  ScpiSupply supply(lend(line), clock);
  supply.apply(kTwelveVolts);
  EXPECT_EQ(line.told.front(), "OUTP:OVP:VAL 13.200");
  const SupplyReading reading = supply.read();
  EXPECT_EQ(reading.protection, SupplyProtection::over_current);
  EXPECT_EQ(reading.regulation, SupplyRegulation::constant_current);
  EXPECT_FALSE(reading.output);
}

TEST_F(ScpiSupplyTest, ReadsWhatItGives) {
  ScpiSupply supply(lend(line), clock);
  const SupplyReading reading = supply.read();
  EXPECT_DOUBLE_EQ(reading.voltage_v, 11.98);
  EXPECT_DOUBLE_EQ(reading.current_a, 1.234);
  EXPECT_DOUBLE_EQ(reading.power_w(), 11.98 * 1.234);
  EXPECT_EQ(reading.regulation, SupplyRegulation::constant_voltage);
  EXPECT_EQ(reading.protection, SupplyProtection::none);
  line.answers["STAT:QUES:COND?"] = "2";
  line.answers["VOLT:PROT:TRIP?"] = "1";
  EXPECT_EQ(supply.read().regulation, SupplyRegulation::constant_current);
  EXPECT_EQ(supply.read().protection, SupplyProtection::over_voltage);
}

TEST_F(ScpiSupplyTest, SwitchesOnOnlyWhileAGuardLivesAndVerifies) {
  ScpiSupply supply(lend(line), clock);
  {
    const supply::PoweredOutput output(supply);
    EXPECT_EQ(line.answers["OUTP?"], "1");
  }
  EXPECT_EQ(line.answers["OUTP?"], "0");
  line.obeys = false;
  EXPECT_THROW(supply::PoweredOutput output(supply), DeviceError);
  EXPECT_EQ(line.told.back(), "OUTP OFF") << "whatever the first order did";
}

TEST_F(ScpiSupplyTest, SurfacesTheInstrumentsOwnErrors) {
  line.answers["SYST:ERR?"] = "-222,\"Data out of range\"";
  EXPECT_THAT(refusal([](ScpiSupply& supply) { supply.apply(kTwelveVolts); }), HasSubstr("Data out of range"));
}

TEST_F(ScpiSupplyTest, TakesZeroWithoutACommaForNoError) {
  for (const char* none : {"0  No Error", "+0  No error", " 0 No Error", "0", "0,\"No error\""}) {
    line.answers["SYST:ERR?"] = none;
    EXPECT_EQ(refusal([](ScpiSupply& supply) { supply.apply(kTwelveVolts); }), "") << none;
  }
  for (const char* error : {"-222  Data Out Of Range", "Error", ""}) {
    line.answers["SYST:ERR?"] = error;
    EXPECT_THAT(refusal([](ScpiSupply& supply) { supply.apply(kTwelveVolts); }), HasSubstr(error)) << error;
  }
}

TEST_F(ScpiSupplyTest, IsServedWithoutTheQueriesThatManyMakesLack) {
  for (const char* query : {"VOLT:PROT:TRIP?", "CURR:PROT:TRIP?", "STAT:QUES:COND?"}) line.answers.erase(query);
  line.answers["SYST:ERR?"] = "-113,\"Undefined header\"";
  ScpiSupply supply(lend(line), clock);
  line.answers["SYST:ERR?"] = "0,\"No error\"";
  EXPECT_EQ(supply.identity().untold, "VOLT:PROT:TRIP?, CURR:PROT:TRIP?, STAT:QUES:COND?");
  supply.apply(kTwelveVolts);
  const SupplyReading reading = supply.read([] {});
  EXPECT_EQ(reading.regulation, SupplyRegulation::unknown);
  EXPECT_EQ(reading.protection, SupplyProtection::none);
  EXPECT_DOUBLE_EQ(reading.voltage_v, 11.98);
  supply.switch_off();
}

TEST_F(ScpiSupplyTest, IsNotTakenForOneWithoutAQueryWhereItWasTooSlow) {
  line.answers.erase("VOLT:PROT:TRIP?");
  EXPECT_THAT(refusal([](ScpiSupply&) {}), HasSubstr("no answer in time"));
}

TEST_F(ScpiSupplyTest, IsOffWhenItSaysSoWhateverItsErrorsAre) {
  line.answers["SYST:ERR?"] = "-113,\"Undefined header\"";
  ScpiSupply supply(lend(line), clock);
  supply.switch_off();
  line.answers["OUTP?"] = "1";
  line.obeys = false;
  EXPECT_THAT(kphi::refusal([&] { supply.switch_off(); }),
              testing::AllOf(HasSubstr("the output stays on"), HasSubstr("Undefined header")));
}

TEST_F(ScpiSupplyTest, AReadingIsLeftBetweenTwoQuestions) {
  ScpiSupply supply(lend(line), clock);
  line.answers.erase("OUTP?");  // would fail if it were asked
  int asked = 0;
  EXPECT_THROW((void)supply.read([&] {
    if (++asked == 2) throw std::runtime_error("something urgent");
  }),
               std::runtime_error);
}

TEST_F(ScpiSupplyTest, RefusesNumbersThatCannotBe) {
  line.answers["MEAS:VOLT?"] = "112";
  EXPECT_THAT(refusal([](ScpiSupply& supply) { (void)supply.read(); }), HasSubstr("is impossible"));
  line.answers["MEAS:VOLT?"] = "9.91E37";
  EXPECT_THAT(refusal([](ScpiSupply& supply) { (void)supply.read(); }), HasSubstr("is not a number"));
  line.answers["*IDN?"] = "hello";
  EXPECT_THAT(refusal([](ScpiSupply&) {}), HasSubstr("does not name a model"));
}

TEST_F(ScpiSupplyTest, RefusesLimitsBeyondTheDevice) {
  ScpiSupply supply(lend(line), clock);
  for (const supply::Limits& limits : {supply::Limits{Volts(40), Amperes(5), Volts(13), Amperes(6)},
                                       supply::Limits{Volts(12), Amperes(-1), Volts(13), Amperes(6)},
                                       supply::Limits{Volts(12), Amperes(5), Volts(std::nan("")), Amperes(6)}}) {
    EXPECT_THROW(supply.apply(limits), std::invalid_argument);
  }
  EXPECT_TRUE(line.told.empty());
}

}  // namespace scpi_supply_test
}  // namespace kphi::scpi
