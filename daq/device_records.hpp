// From what the drivers say to what a run file holds.
#pragma once

#include "drivers/iq/session.hpp"
#include "drivers/netbox/configuration.hpp"
#include "drivers/netbox/session.hpp"
#include "results/records.hpp"

namespace kphi::daq {

[[nodiscard]] results::LoadCellRecord to_record(const netbox::StampedRecord& stamped) noexcept;
[[nodiscard]] results::MotorReading to_reading(const iq::Reading& reading) noexcept;
[[nodiscard]] results::LoadCellScale to_scale(const netbox::Configuration& configuration);
[[nodiscard]] results::SampleAccount to_account(const netbox::Counters& counters) noexcept;

}  // namespace kphi::daq
