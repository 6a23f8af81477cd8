// Where a Net Box answers.
#pragma once

#include <cstdint>
#include <string>

namespace kphi::netbox {

struct Address {
  std::string host;
  std::uint16_t rdt_port = 49152;
  std::uint16_t http_port = 80;
};

}  // namespace kphi::netbox
