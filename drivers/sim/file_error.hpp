// What is wrong with a file for the simulated bench.
#pragma once

#include <stdexcept>

namespace kphi::sim {

/// The message reads "path:line:column: what; the next move".
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace kphi::sim
