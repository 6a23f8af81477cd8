// A bus of one test's own, and on it a stand-in for logind: nobody else's sleep is touched.
#pragma once

#include <systemd/sd-bus.h>

#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "test/end_to_end/process.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::test {

/// While it lives it is the system bus for this process and its children.
class PrivateBus {
 public:
  /// Throws when dbus-daemon is not installed.
  PrivateBus();
  ~PrivateBus();
  PrivateBus(const PrivateBus&) = delete;
  PrivateBus& operator=(const PrivateBus&) = delete;

  /// The test's own connection.
  [[nodiscard]] sd_bus* connection() const { return connection_; }
  /// Starts `arguments` and returns when somebody owns `name`.
  [[nodiscard]] std::unique_ptr<Process> start_owner(const std::string& name,
                                                     const std::vector<std::string>& arguments) const;

 private:
  TemporaryFolder folder_;
  Process daemon_;
  sd_bus* connection_ = nullptr;
};

/// One line of logind's list.
struct Inhibitor {
  std::string what, who, why, mode;
  friend bool operator==(const Inhibitor&, const Inhibitor&) = default;
  friend std::ostream& operator<<(std::ostream& out, const Inhibitor& one) {
    return out << one.who << " " << one.mode << "s " << one.what << ": " << one.why;
  }
};

/// python3-dbusmock's logind on a bus.
class LogindMock {
 public:
  explicit LogindMock(const PrivateBus& bus);
  [[nodiscard]] static bool available();

  [[nodiscard]] std::vector<Inhibitor> inhibitors() const;
  /// Asks until the list has `count` entries, 10 s at most; returns the last one.
  [[nodiscard]] std::vector<Inhibitor> inhibitors_once_they_are(std::size_t count) const;
  /// From now on refuses what contains `part`; "": everything.
  void refuse(const std::string& part) const;

 private:
  const PrivateBus& bus_;
  std::unique_ptr<Process> process_;
};

}  // namespace kphi::test
