// The page: daq/live/page/ and the chart library, joined into one HTML text by CMake. It loads nothing.
#pragma once

#include <string>

namespace kphi::daq::live {

[[nodiscard]] std::string page_text();

}  // namespace kphi::daq::live
