// The Net Box's pages of all its configurations and calibrations, verbatim: kept with every run, since a box has
// neither a factory reset nor a history.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "drivers/netbox/configuration/finding.hpp"

namespace kphi::daq {

/// Body of one page of the box's web server, "/netftapi2.xml?index=3". Throws DeviceError.
using PageReader = std::function<std::string(const std::string& target)>;

struct SlotPages {
  std::string json;  ///< {"netftapi2.xml?index=0": "<?xml …", …}; null for a page that did not come
  std::vector<netbox::Finding> findings;
};

/// Reads the 32 pages, up to the first failure.
[[nodiscard]] SlotPages read_slot_pages(const PageReader& page);

}  // namespace kphi::daq
