// A file a person wrote that cannot be used as it stands. Exit code 2.
#pragma once

#include <stdexcept>

namespace kphi {

/// The message reads "file:line:column: what is wrong; the next move".
class ConfigurationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace kphi
