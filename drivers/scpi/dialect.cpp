#include "drivers/scpi/dialect.hpp"

#include <algorithm>
#include <iterator>

namespace kphi::scpi {
namespace {

// SCPI-99 volume 2 for the last row; the makers' programming guides for the others.
constexpr Dialect kDialects[] = {
    {"Rigol DP800", "RIGOL TECHNOLOGIES,DP8", "OUTP:OVP:VAL", "OUTP:OVP ON", "OUTP:OCP:VAL", "OUTP:OCP ON",
     "OUTP:OVP:QUES?", "OUTP:OCP:QUES?", "OUTP:MODE?", true, 0.001, 0.001},
    {"SCPI-99", "", "VOLT:PROT", "VOLT:PROT:STAT ON", "CURR:PROT", "CURR:PROT:STAT ON", "VOLT:PROT:TRIP?",
     "CURR:PROT:TRIP?", "STAT:QUES:COND?", false, 0.001, 0.001},
};

}  // namespace

const Dialect& dialect_of(std::string_view identity) noexcept {
  return *std::find_if(std::begin(kDialects), std::end(kDialects) - 1, [&](const Dialect& dialect) {
    return identity.find(dialect.identity) != std::string_view::npos;
  });
}

}  // namespace kphi::scpi
