// Data that cannot be fitted as asked. Exit code 5: data rejected.
#pragma once

#include <stdexcept>

namespace kphi::fit {

/// The message says what is wrong with the data and what to do next.
class FitError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace kphi::fit
