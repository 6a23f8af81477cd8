// The Net Box's web side: netftapi2.xml and netftcalapi.xml in the form that a real box was seen to send.
#pragma once

#include <string>
#include <string_view>

namespace kphi::sim {

class NetBoxDevice;

/// HTTP/1.0 response to one request. GET of the two XML pages, with or without ?index=0..15; anything else is 404
/// (also writes by CGI, which this version does not offer).
[[nodiscard]] std::string netbox_answer(const NetBoxDevice& box, std::string_view request);

}  // namespace kphi::sim
