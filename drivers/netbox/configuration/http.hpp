// The two verbs of the box's web server: read a page, write settings. Both are a GET.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "base/tcp.hpp"

namespace kphi::netbox {

/// The box answers this to written settings, even if it ignores them.
inline constexpr int kFound = 302;

/// How long a box that refuses is asked again. Some serve three requests a second and refuse the next: the port, the
/// connection without a word, or with status 429 or 503.
inline constexpr std::chrono::milliseconds kRefusedFor{1500};

/// Body of `http://host:port<target>`; HTTP/1.0, one request per connection, at most 1 MiB. Asks again after a refusal,
/// for `refused_for`. Blocks for at most `wall_timeout`. Throws DeviceError without a connection or a complete answer
/// in time, or for another status. To write settings `target` is one of the box's CGI pages with all its variables,
/// "/comm.cgi?comrdtrate=1000", and `wanted_status` is kFound: read them back.
[[nodiscard]] std::string http_get(const Host& host, std::uint16_t port, const std::string& target,
                                   std::chrono::nanoseconds wall_timeout, int wanted_status = 200,
                                   std::chrono::nanoseconds refused_for = kRefusedFor);

}  // namespace kphi::netbox
