// What tests of files say: a text with one thing changed, and the refusals that it earns.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "profiles/strict_yaml.hpp"
#include "test/source_dir.hpp"

namespace kphi::profiles {

/// Each finding as "line:column: what; next move"; empty if `read` accepts the text.
template <class Read>
std::vector<std::string> refusals(Read read) {
  std::vector<std::string> lines;
  try {
    static_cast<void>(read());
  } catch (const RefusedFile& refused) {
    for (const FileFinding& finding : refused.findings()) lines.push_back(describe("", finding).substr(1));
  }
  return lines;
}

/// `text` with the first `from` replaced; the test fails if there is none.
inline std::string changed(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << "the text has no \"" << from << '"';
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

/// A change, and the one refusal that it earns; "…" at the end: whatever follows; empty: none.
struct Earned {
  std::string from, to, refusal;
};

template <class Refused>
void expect_refusals(const Refused& refused, const std::vector<Earned>& changes) {
  for (const auto& [from, to, refusal] : changes) {
    const std::vector<std::string> found = refused(from, to);
    const std::size_t open = refusal.find("…");
    ASSERT_EQ(found.size(), refusal.empty() ? 0u : 1u) << from << " -> " << to;
    EXPECT_EQ(refusal.empty() ? "" : found[0].substr(0, open), refusal.substr(0, open)) << from << " -> " << to;
  }
}

inline std::string shipped(const std::string& name) { return kphi::test::source_dir() + "/profiles/" + name; }

inline constexpr const char* kCampaignText =
    "format: kphi-campaign/1\n"            // 1
    "name: short\n"                        // 2
    "operator: Ada\n"                      // 3
    "propeller:\n"                         // 4
    "  id: 5x3\n"                          // 5
    "  name: five inches, three blades\n"  // 6
    "  diameter_in: 5\n"                   // 7
    "  blades: 3\n"                        // 8
    "occlusions_deg: [0, 45, 90]\n"        // 9
    "repetitions: 2\n"                     // 10
    "profile:\n"                           // 11
    "  steps: 4\n"                         // 12
    "  dwell_s: 2.0\n"                     // 13
    "  first_rpm: 100\n"                   // 14
    "  last_rpm: 19100\n"                  // 15
    "zero_s: 3.0\n"                        // 16
    "minimum_discard_s: 0.5\n"             // 17
    "supply_v: 12.0\n"                     // 18
    "limits:\n"                            // 19
    "  speed_max_rpm: 19100\n"             // 20
    "  thrust_max_n: 20\n"                 // 21
    "  supply_current_max_a: 35\n"         // 22
    "  coil_temperature_max_degc: 110\n";  // 23

inline constexpr const char* kBenchText =
    "format: kphi-bench/1\n"        // 1
    "name: bench\n"                 // 2
    "netbox:\n"                     // 3
    "  host: 192.168.1.1\n"         // 4
    "  rdt_port: 50000\n"           // 5
    "  http_port: 8080\n"           // 6
    "  rate_hz: 3500\n"             // 7
    "  records_per_datagram: 20\n"  // 8
    "iq:\n"                         // 9
    "  device: /dev/ttyUSB0\n"      // 10
    "  baud: 921600\n"              // 11
    "  module_id: 7\n"              // 12
    "  spin: -1\n"                  // 13
    "  telemetry_hz: 100\n"         // 14
    "  speed_max_rpm: 19300\n"      // 15
    "thrust_axis: -Fx\n"            // 16
    "simulation:\n"                 // 17
    "  time_scale: 20\n"            // 18
    "  seed: 5\n"                   // 19
    "  control: /tmp/control\n";    // 20

inline constexpr const char* kVehicleText =
    "format: kphi-vehicle/1\n"             // 1
    "name: drone\n"                        // 2
    "half_side_m: 0.045\n"                 // 3
    "arm_length_m: 0.117\n"                // 4
    "propeller_radius_m: 0.0635\n"         // 5
    "hinge_turn_deg: [0, 90, 180, 270]\n"  // 6
    "shapes_deg:\n"                        // 7
    "  X: [45, 45, 45, 45]\n"              // 8
    "  O: [180, 180, 165.676, 180]\n"      // 9
    "arm_angle_min_deg: -90\n"             // 10
    "arm_angle_max_deg: 180\n"             // 11
    "speed_min_rpm: 0\n"                   // 12
    "speed_max_rpm: 19100\n";              // 13

}  // namespace kphi::profiles
