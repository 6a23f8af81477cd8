// Findings about a box are findings about a device.
#pragma once

#include "base/finding.hpp"

namespace kphi::netbox {

using kphi::Finding;
using kphi::Severity;

}  // namespace kphi::netbox
