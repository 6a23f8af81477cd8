// libFuzzer: any bytes are a campaign, or are refused as a ConfigurationError; nothing else happens.
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/error.hpp"
#include "profiles/campaign.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    static_cast<void>(
        kphi::profiles::parse_campaign(std::string(reinterpret_cast<const char*>(data), size), "fuzz.yaml"));
  } catch (const kphi::ConfigurationError&) {
  }
  return 0;
}
