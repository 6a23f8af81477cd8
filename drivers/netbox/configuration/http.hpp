// The two verbs of the box's web server: read a page, write settings. Both are a GET.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace kphi::netbox {

/// Body of `http://host:port<target>`; HTTP/1.0, one request per connection, at most 1 MiB. Blocks for at most
/// `wall_timeout`. Throws DeviceError without a connection or a complete answer in time, or if the status is not 200.
[[nodiscard]] std::string http_get(const std::string& host, std::uint16_t port, const std::string& target,
                                   std::chrono::nanoseconds wall_timeout);

/// Writes settings: `target` is one of the box's CGI pages with all its variables, "/comm.cgi?comrdtrate=1000". The box
/// answers HTTP/1.0 302 Found even if it ignores them: read them back. As http_get; throws for any other answer.
void http_write(const std::string& host, std::uint16_t port, const std::string& target,
                std::chrono::nanoseconds wall_timeout);

}  // namespace kphi::netbox
