// Texts of profiles/*.yaml, which `kphi init` writes.
#pragma once

namespace kphi::commands {

extern const char* const kCampaignTemplate;
extern const char* const kBenchTemplate;
extern const char* const kSimulatedBenchTemplate;
extern const char* const kVehicleTemplate;

}  // namespace kphi::commands
