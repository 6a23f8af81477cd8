// The words of a refusal.
#pragma once

#include <string>

#include "base/error.hpp"

namespace kphi {

/// Of the error of kphi that the call throws; empty: none.
template <class Call>
[[nodiscard]] std::string refusal(Call&& call) {
  try {
    (void)call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace kphi
