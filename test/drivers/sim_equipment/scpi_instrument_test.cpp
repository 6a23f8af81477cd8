#include "test/drivers/sim_equipment/scpi_instrument.hpp"

#include <gtest/gtest.h>

#include "base/random.hpp"

namespace kphi::sim::scpi_instrument_test {

TEST(SimulatedScpiInstrument, KnowsShortAndLongFormsInAnyCase) {
  ScpiInstrument supply;
  EXPECT_EQ(supply.apply("*IDN?"), "KPHI,SIM3010,SN0001,1.00");
  for (const char* set : {"VOLT 12.5", "volt 12.5", "VOLTAGE 12.5", ":Voltage\t12.5"}) {
    EXPECT_EQ(supply.apply("VOLT 0"), "");
    EXPECT_EQ(supply.apply(set), "") << set;
    EXPECT_EQ(supply.apply("voltage?"), "12.500") << set;
  }
  EXPECT_EQ(supply.apply("SYST:ERR?"), "0,\"No error\"");
  EXPECT_EQ(supply.apply("VOLT 3;VOLT?;CURR? MAX"), "3.000;10.000");
}

TEST(SimulatedScpiInstrument, QueuesWhatItDoesNotLike) {
  ScpiInstrument supply;
  for (const char* wrong : {"FOO 1", "VOLT 31", "VOLT -1", "VOLT x", "VOLTA 1", "OUTP 2"})
    EXPECT_EQ(supply.apply(wrong), "") << wrong;
  for (const char* code : {"-113", "-222", "-222", "-104", "-113", "-104", "0"})
    EXPECT_EQ(supply.apply("SYST:ERR?").substr(0, std::string(code).size()), code);
  for (int i = 0; i < 40; ++i) (void)supply.apply("FOO");
  EXPECT_EQ(supply.state().errors.size(), 16u);
  EXPECT_EQ(supply.state().errors.back().first, -350);
  EXPECT_EQ(supply.apply("*CLS;SYST:ERR?"), "0,\"No error\"");
}

TEST(SimulatedScpiInstrument, ReportsItsErrorsWithoutACommaIfItIsOfSuchAMaker) {
  ScpiType type;
  type.plain_errors = true;
  ScpiInstrument supply(type);
  EXPECT_EQ(supply.apply("SYST:ERR?"), "0  No Error");
  EXPECT_EQ(supply.apply("FOO;SYST:ERR?"), "-113  Undefined header");
}

TEST(SimulatedScpiInstrument, HoldsTheVoltageUntilTheLimitOfTheCurrent) {
  ScpiInstrument supply;
  supply.connect_load(6);
  EXPECT_EQ(supply.apply("VOLT 12;CURR 5;OUTP ON;MEAS:VOLT?;MEAS:CURR?;STAT:QUES:COND?"), "12.000;2.000;1");
  supply.connect_load(1);
  EXPECT_EQ(supply.apply("MEAS:VOLT?;MEAS:CURR?;MEAS:POW?;STAT:QUES:COND?"), "5.000;5.000;25.000;2");
  EXPECT_EQ(supply.apply("OUTP OFF;MEAS:VOLT?"), "0.000");
}

TEST(SimulatedScpiInstrument, TripsAndSwitchesOff) {
  ScpiInstrument supply;
  supply.connect_load(6);
  (void)supply.apply("VOLT 12;CURR 5;CURR:PROT 3;CURR:PROT:STAT ON;OUTP ON");
  supply.connect_load(3);
  EXPECT_EQ(supply.apply("OUTP?;CURR:PROT:TRIP?;VOLT:PROT:TRIP?;MEAS:CURR?"), "0;1;0;0.000");
  supply.connect_load(6);
  EXPECT_EQ(supply.apply("OUTP ON;OUTP?;CURR:PROT:TRIP?"), "1;0");
  EXPECT_EQ(supply.apply("VOLT:PROT 11;VOLT:PROT:STAT ON;OUTP?;VOLT:PROT:TRIP?"), "1;0");
  EXPECT_EQ(supply.apply("OUTP?;VOLT:PROT:TRIP?"), "0;1") << "it acts once the message is done";
}

TEST(SimulatedScpiInstrument, SpeaksAnotherMakersWords) {
  ScpiInstrument supply({"RIGOL TECHNOLOGIES,DP832,DP8A1,1.0", ScpiKind::supply, ScpiFamily::rigol});
  EXPECT_EQ(supply.apply("OUTP:OVP:VAL 20;OUTP:OVP ON;OUTP:OVP:VAL?;OUTP:OVP:QUES?;OUTP:MODE?;OUTP?"),
            "20.000;NO;CV;OFF");
  EXPECT_EQ(supply.apply("VOLT:PROT 5;SYST:ERR?").substr(0, 4), "-113");
}

TEST(SimulatedScpiInstrument, MeasuresWhatIsPresented) {
  ScpiInstrument meter({"KPHI,DMM,1,1", ScpiKind::meter});
  meter.present(12.345678, 4.5);
  EXPECT_EQ(meter.apply("MEAS:VOLT:DC?"), "+1.23456780E+01");
  EXPECT_EQ(meter.apply("MEAS:CURR?"), "+4.50000000E+00");
  EXPECT_EQ(meter.apply("VOLT 3;SYST:ERR?").substr(0, 4), "-113") << "no supply";
}

TEST(SimulatedScpiInstrument, AnswersAnythingWithinItsLimits) {
  Random random(1);
  const std::vector<std::string> words{"VOLT", "CURR", ":",    "PROT", "?",   " ",   ";",    "OUTP", "ON",   "1e400",
                                       "-3",   "nan",  "TRIP", "MEAS", "MAX", "MIN", "STAT", "\t",   "*IDN", "12.5"};
  for (const ScpiFamily family : {ScpiFamily::standard, ScpiFamily::rigol}) {
    ScpiInstrument supply({"A,B,C,D", ScpiKind::supply, family});
    supply.connect_load(2);
    for (int i = 0; i < 50'000; ++i) {
      std::string message;
      for (std::uint64_t n = random.bits() % 12; n > 0; --n) {
        message += random.bits() % 10 == 0 ? std::string(1, static_cast<char>(random.bits()))
                                           : words[random.bits() % words.size()];
      }
      (void)supply.apply(message);
      const ScpiState state = supply.state();
      ASSERT_TRUE(state.voltage_v >= 0 && state.voltage_v <= 30) << message;
      ASSERT_TRUE(state.current_a >= 0 && state.current_a <= 10) << message;
      ASSERT_LE(state.errors.size(), 16u);
      ASSERT_FALSE(state.output && (state.over_voltage_tripped || state.over_current_tripped)) << message;
      const auto [volts, amperes] = supply.terminals();
      ASSERT_TRUE(volts <= state.voltage_v + 1e-12 && amperes <= state.current_a + 1e-12) << message;
    }
  }
}

}  // namespace kphi::sim::scpi_instrument_test
