// Values read off a thermometer and a barometer: constant during a campaign.
#pragma once

#include "drivers/ambient/ambient.hpp"

namespace kphi::ambient {

class ManualAmbient final : public Ambient {
 public:
  /// Throws std::invalid_argument unless plausible.
  explicit ManualAmbient(const Air& air);
  [[nodiscard]] Air read() override { return air_; }
  [[nodiscard]] const std::string& identity() const noexcept override { return identity_; }

 private:
  Air air_;
  std::string identity_ = "values written by hand";
};

}  // namespace kphi::ambient
