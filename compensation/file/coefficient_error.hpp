// A coefficient file that cannot be used.
#pragma once

#include <stdexcept>
#include <string>

namespace kphi::compensation {

/// A coefficient file that cannot be used. The message is "file:line: what is wrong; the next step".
class CoefficientError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace kphi::compensation
