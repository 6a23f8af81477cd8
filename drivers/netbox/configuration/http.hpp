// The two verbs of the box's web server: read a page, write settings. Both are a GET.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "base/tcp.hpp"

namespace kphi::netbox {

/// The box answers this to written settings, even if it ignores them.
inline constexpr int kFound = 302;

/// Body of `http://host:port<target>`; HTTP/1.0, one request per connection, at most 1 MiB. Blocks for at most
/// `wall_timeout`. Throws DeviceError without a connection or a complete answer in time, or for another status.
/// To write settings `target` is one of the box's CGI pages with all its variables, "/comm.cgi?comrdtrate=1000", and
/// `wanted_status` is kFound: read them back.
[[nodiscard]] std::string http_get(const Host& host, std::uint16_t port, const std::string& target,
                                   std::chrono::nanoseconds wall_timeout, int wanted_status = 200);

}  // namespace kphi::netbox
