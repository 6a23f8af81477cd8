// Who may include whom. The table is the rule; design and code follow it.
#pragma once

#include <string>
#include <vector>

namespace kphi::house {

/// One room (or a folder in it) and what its files may include from this repository.
/// Allowed entries: "drivers/iq/" is everything below, "drivers/*" the files directly in it, else one header.
struct Rule {
  std::string folder;
  std::vector<std::string> allowed;
};

/// The most specific folder counts. Commands (`commands.cpp`, `…_commands.cpp`) belong to the program and are free.
inline const std::vector<Rule>& rules() {
  static const std::vector<Rule> kRules{
      // A vehicle file describes an airframe and is checked as one.
      {"profiles/", {"profiles/", "compensation/units.hpp", "compensation/airframe.hpp", "compensation/occlusion.hpp"}},
      {"drivers/", {"drivers/*", "compensation/units.hpp"}},
      {"drivers/serial/", {"drivers/*", "drivers/serial/", "compensation/units.hpp"}},
      {"drivers/netbox/", {"drivers/*", "drivers/netbox/", "compensation/units.hpp"}},
      {"drivers/iq/", {"drivers/*", "drivers/iq/", "drivers/serial/", "compensation/units.hpp"}},
      {"drivers/supply/", {"drivers/*", "drivers/supply/", "drivers/serial/", "compensation/units.hpp"}},
      {"drivers/ambient/", {"drivers/*", "drivers/ambient/", "drivers/usb/", "compensation/units.hpp"}},
      {"drivers/usb/", {"drivers/*", "drivers/usb/", "compensation/units.hpp"}},
      // An instrument that speaks SCPI is one kind of supply: it sees what a supply is, not how another one is driven.
      {"drivers/scpi/",
       {"drivers/*", "drivers/scpi/", "drivers/usb/", "drivers/supply/supply.hpp", "compensation/units.hpp"}},
      // The other end of each wire: of the drivers only the enums of codes.
      {"drivers/sim/",
       {"drivers/*", "drivers/sim/", "drivers/netbox/codes.hpp", "drivers/iq/codes.hpp", "compensation/units.hpp"}},
      {"results/",
       {"results/", "profiles/campaign.hpp", "profiles/bench.hpp", "profiles/vehicle.hpp",
        "profiles/configuration_error.hpp", "compensation/units.hpp"}},
      {"daq/", {"daq/", "results/", "drivers/", "profiles/", "compensation/units.hpp"}},
      {"fit/", {"fit/", "results/", "compensation/", "profiles/configuration_error.hpp"}},
      // The program's way in: a campaign folder brings its profile files.
      {"fit/fit_input", {"fit/", "results/", "profiles/"}},
      {"compensation/", {"compensation/*", "compensation/flight/"}},
      {"compensation/flight/", {"compensation/*", "compensation/flight/"}},
      {"compensation/file/", {"compensation/*", "compensation/file/"}},
  };
  return kRules;
}

/// What the text of the file at `path` (relative to the repository) includes against the rules: "path:line: …".
[[nodiscard]] std::vector<std::string> violations(const std::string& path, const std::string& text);

}  // namespace kphi::house
