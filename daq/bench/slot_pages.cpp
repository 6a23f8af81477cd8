#include "daq/bench/slot_pages.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/error.hpp"

namespace kphi::daq {
namespace {

constexpr int kSlots = 16;

}  // namespace

SlotPages read_slot_pages(const PageReader& page) {
  SlotPages read;
  nlohmann::ordered_json pages;
  for (const char* name : {"netftapi2.xml", "netftcalapi.xml"}) {
    for (int slot = 0; slot < kSlots; ++slot) {
      const std::string target = fmt::format("{}?index={}", name, slot);
      pages[target] = nullptr;
      if (!read.findings.empty()) continue;
      try {
        pages[target] = page("/" + target);
      } catch (const DeviceError& error) {
        read.findings.push_back({netbox::Severity::warning,
                                 fmt::format("could not read all slots of the box: {}", error.what()),
                                 "the runs will lack the settings of some slots; check the box: `kphi devices`"});
      }
    }
  }
  read.json = pages.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return read;
}

}  // namespace kphi::daq
