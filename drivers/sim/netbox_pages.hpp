// The Net Box's web side: netftapi2.xml and netftcalapi.xml in the form that a real box was seen to send.
#pragma once

#include <string>
#include <string_view>

namespace kphi::sim {

class NetBoxDevice;

/// HTTP/1.0 response to one request. GET of the two XML pages, with or without ?index=0..15; anything else is 404.
/// Writes are the device's own: netbox_cgi.cpp.
[[nodiscard]] std::string netbox_answer(const NetBoxDevice& box, std::string_view request);

}  // namespace kphi::sim
