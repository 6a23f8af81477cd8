// The words of a device's refusal.
#pragma once

#include <string>

#include "base/error.hpp"

namespace kphi {

/// Of the DeviceError that the call throws; empty: none.
template <class Call>
[[nodiscard]] std::string refusal(Call&& call) {
  try {
    (void)call();
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "";
}

}  // namespace kphi
