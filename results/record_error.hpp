// A record of a run that could not be written, read or trusted.
#pragma once

#include <stdexcept>

namespace kphi::results {

/// The message reads "file: what happened: cause; the next move". It begins with "disk full: " when there was no room.
class RecordError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What is there is not what was accepted (exit code 5).
class DataRejected : public RecordError {
 public:
  using RecordError::RecordError;
};

}  // namespace kphi::results
