// What the faults of a script can have to do with: when, and with which device.
#pragma once

#include <string>
#include <vector>

#include "base/clock.hpp"
#include "drivers/sim/script/faults.hpp"

namespace kphi::soak {

enum class Device { load_cell, motor, supply, air };

struct Reach {
  Device device;
  std::string kind;
  Instant begin, end;          ///< acts between the two
  bool silences_line = false;  ///< the module may not hear, or not apply, the host

  [[nodiscard]] bool meets(Instant from, Instant to) const noexcept { return begin <= to && end >= from; }
};

class Reaches {
 public:
  /// Of a whole fault script.
  explicit Reaches(const std::string& faults);
  /// Of the load cell, without what harms nobody.
  [[nodiscard]] const sim::FaultScript& cell() const noexcept { return cell_; }
  [[nodiscard]] bool any(Instant from, Instant to) const noexcept;
  [[nodiscard]] bool any(Device device, Instant from, Instant to) const noexcept;
  /// Between the two the module may be deaf to the host.
  [[nodiscard]] bool line_silenced(Instant from, Instant to) const noexcept;

 private:
  sim::FaultScript cell_;
  std::vector<Reach> all_;
};

}  // namespace kphi::soak
