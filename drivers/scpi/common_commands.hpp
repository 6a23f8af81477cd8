// What every SCPI instrument knows: who it is, and what it did not like.
#pragma once

#include <array>
#include <string>

#include "drivers/scpi/line.hpp"

namespace kphi::scpi {

/// Maker, model, serial number, firmware (IEEE 488.2, 10.14); empty where *IDN? says less.
[[nodiscard]] std::array<std::string, 4> identity_fields(const std::string& identity);

/// The oldest error in the instrument's queue (SYST:ERR?), taken out of it; empty: none. Errors of the conversation
/// (-400 to -499: a query interrupted or not fetched) blame no command and are passed over.
[[nodiscard]] std::string next_error(Line& line);

/// Takes out all that is there, so that nobody is blamed for it.
void forget_errors(Line& line);

}  // namespace kphi::scpi
