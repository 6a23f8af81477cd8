// The modules of the codebase from the lowest layer up, and who may see whom. The table is the rule.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace kphi::house {

/// A folder and what its files may include from this repository besides their own folder. An entry names a folder (with
/// all modules in it that stand earlier in the table) or one header.
struct Room {
  std::string_view folder;
  std::vector<std::string_view> sees;
};

/// A module includes only modules that stand before it, so no includes form a circle.
inline const std::vector<Room>& rooms() {
  static const std::vector<Room> kRooms{
      {"base", {}},
      // The library that flies stands alone.
      {"compensation", {}},
      {"compensation/file", {"compensation"}},
      {"compensation/flight", {"compensation", "base"}},
      {"compensation/integrations", {"compensation"}},
      {"compensation/python", {"compensation"}},
      {"profiles", {"base", "compensation"}},

      {"drivers/serial", {"base"}},
      {"drivers/usb", {"base"}},
      {"drivers/netbox/wire", {"base"}},
      {"drivers/netbox/configuration", {"base", "drivers/netbox"}},
      {"drivers/netbox/stream", {"base", "drivers/netbox"}},
      {"drivers/netbox/receive", {"base", "drivers/netbox"}},
      {"drivers/iq/wire", {"base", "compensation/units.hpp"}},
      {"drivers/iq/exchange", {"base", "compensation/units.hpp", "drivers/iq"}},
      {"drivers/iq/session", {"base", "compensation/units.hpp", "drivers/iq"}},
      {"drivers/iq/link", {"base", "compensation/units.hpp", "drivers/iq", "drivers/serial"}},
      {"drivers/iq/service", {"base", "compensation/units.hpp", "drivers/iq", "drivers/serial"}},
      {"drivers/supply", {"base", "compensation/units.hpp", "drivers/serial"}},
      {"drivers/ambient", {"base", "drivers/usb"}},
      // An instrument that speaks SCPI is one kind of supply: it sees what a supply is, not how another one is driven.
      {"drivers/scpi", {"base", "drivers/usb", "drivers/supply/supply.hpp"}},

      // The other end of each wire: of the drivers only the enums of codes.
      {"drivers/sim/physics", {"base", "compensation/units.hpp"}},
      {"drivers/sim/script", {"base"}},
      {"drivers/sim/transport", {"base"}},
      {"drivers/sim/netbox", {"base", "drivers/sim/physics", "drivers/sim/script", "drivers/sim/transport"}},
      {"drivers/sim/iq",
       {"base", "compensation/units.hpp", "drivers/sim/physics", "drivers/sim/script", "drivers/sim/transport",
        "drivers/iq/wire/codes.hpp"}},
      {"drivers/sim/supply", {"base", "drivers/sim/script", "drivers/sim/transport"}},
      {"drivers/sim/usb", {"base", "drivers/sim/script"}},
      {"drivers/sim", {"base", "drivers/sim"}},

      {"results", {"base", "compensation/units.hpp"}},
      {"results/reduction", {"base", "compensation/units.hpp", "results"}},

      {"daq/bench", {"base", "compensation/units.hpp", "profiles", "results", "drivers"}},
      {"daq/guard", {"base", "compensation/units.hpp", "profiles", "results", "drivers", "daq"}},
      {"daq/audit", {"base", "compensation/units.hpp", "profiles", "results", "drivers", "daq"}},
      {"daq/sentinel", {"base"}},
      {"daq/hardware", {"base", "compensation/units.hpp", "profiles", "results", "drivers", "daq"}},
      {"daq/virtual", {"base", "compensation/units.hpp", "profiles", "results", "drivers", "daq"}},
      {"daq/run", {"base", "compensation/units.hpp", "profiles", "results", "drivers", "daq"}},
      {"daq/campaign", {"base", "compensation/units.hpp", "profiles", "results", "drivers", "daq"}},
      {"daq/spin", {"base", "compensation/units.hpp", "profiles", "results", "drivers", "daq"}},
      {"daq/weigh", {"base", "compensation/units.hpp", "profiles", "results", "drivers", "daq"}},
      {"daq/live", {"base", "compensation/units.hpp", "profiles", "results", "daq"}},
      {"daq", {"base", "profiles", "daq"}},

      {"fit/numerics", {"base", "results"}},
      {"fit/model", {"base", "compensation", "results", "fit"}},
      {"fit/signal", {"base", "compensation", "results", "fit"}},
      {"fit/uncertainty", {"base", "compensation", "results", "fit"}},
      // A layout file is a profile as others are.
      {"fit/logs", {"base", "compensation", "profiles/profile_reader.hpp", "results", "fit"}},
      {"fit/flights", {"base", "compensation", "profiles/profile_reader.hpp", "results", "fit"}},
      {"fit/propellers", {"base", "compensation", "results", "fit"}},
      // Of a campaign that was not run yet: the only module of the fit that sees one.
      {"fit/plan", {"base", "compensation", "profiles", "results", "fit"}},
      {"fit/coefficients", {"base", "compensation", "profiles/vehicle.hpp", "results", "fit"}},
      {"fit/report", {"base", "compensation", "results", "fit"}},
      {"fit/export", {"base", "compensation", "profiles/vehicle.hpp", "results", "fit"}},

      // Drivers that are not kphi's own: what anybody's would see.
      {"examples/second_bench",
       {"base", "compensation/units.hpp", "profiles/bench_config.hpp", "drivers", "results/records.hpp", "daq/bench"}},

      {"commands", {"base", "compensation", "profiles", "drivers", "results", "daq", "fit", "examples"}},
      {"commands/shell", {"base", "commands"}},
      {"commands/stand", {"base", "compensation", "profiles", "drivers", "results", "daq", "commands"}},
  };
  return kRooms;
}

/// At most this many units (a header and its source are one) side by side.
inline constexpr int kUnitsSideBySide = 20;

/// The module of a file; nullptr: of none.
[[nodiscard]] const Room* room_of(std::string_view path);

/// What the file at `path` (from the repository's root) includes against the rules: "path:line: …".
[[nodiscard]] std::vector<std::string> violations(const std::string& path, const std::string& text);

}  // namespace kphi::house
