// The errors of every module, and the exit code that the program ends with. Malformed bytes from a wire are not errors:
// they are counted.
#pragma once

#include <stdexcept>
#include <string>

namespace kphi {

/// Of the program. Fixed: scripts rely on them.
enum class ExitCode : int {
  ok = 0,
  failure = 1,
  usage = 2,  ///< or configuration
  no_device = 3,
  safety_stop = 4,
  data_rejected = 5,
  in_use = 6,         ///< bench or folder, by another program
  interrupted = 130,  ///< after a controlled spin-down
};

/// what() is one line: "where: what happened: cause; next move".
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message, ExitCode exit_code = ExitCode::failure)
      : std::runtime_error(message), exit_code_(exit_code) {}
  [[nodiscard]] ExitCode exit_code() const noexcept { return exit_code_; }

 private:
  ExitCode exit_code_;
};

/// A file or option that a person wrote and that cannot be used as it stands.
class ConfigurationError : public Error {
 public:
  explicit ConfigurationError(const std::string& message) : Error(message, ExitCode::usage) {}
};

/// Runs `work`; an argument that it refuses becomes a ConfigurationError of `where`.
template <class Work>
auto configured(const std::string& where, Work&& work) {
  try {
    return work();
  } catch (const std::invalid_argument& error) {
    throw ConfigurationError(where + ": " + error.what());
  }
}

/// A device operation that failed.
class DeviceError : public Error {
 public:
  explicit DeviceError(const std::string& message) : Error(message, ExitCode::no_device) {}
  /// `device`: "Net Box 192.168.1.1"; `operation`: "read configuration"; `next_move` may be empty.
  DeviceError(const std::string& device, const std::string& operation, const std::string& cause,
              const std::string& next_move = {})
      : DeviceError(device + ": " + operation + ": " + cause + (next_move.empty() ? "" : "; " + next_move)) {}
};

/// A bench or a folder that another program uses.
class InUse : public Error {
 public:
  explicit InUse(const std::string& message) : Error(message, ExitCode::in_use) {}
};

/// A record that could not be written or read. Starts with "disk full: " if there was no room.
class RecordError : public Error {
 public:
  explicit RecordError(const std::string& message, ExitCode exit_code = ExitCode::failure)
      : Error(message, exit_code) {}
};

/// A record that is not what was accepted when it was written.
class DataRejected : public RecordError {
 public:
  explicit DataRejected(const std::string& message) : RecordError(message, ExitCode::data_rejected) {}
};

/// Data that cannot be fitted as asked.
class FitError : public Error {
 public:
  explicit FitError(const std::string& message) : Error(message, ExitCode::data_rejected) {}
};

}  // namespace kphi
