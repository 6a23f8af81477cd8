// Access control of the live page. Pages of other sites can make a browser request anything from 127.0.0.1, even under
// a name of their own (DNS rebinding), but they cannot know the token, or forge Host and Origin.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace kphi::daq::live {

/// The parts of an HTTP request that decide.
struct AccessRequest {
  std::string_view method;
  std::string_view target;  ///< "/?token=…"
  std::string_view host;
  std::optional<std::string_view> origin;  ///< absent: not a browser, or an address typed in
  bool upgrade = false;                    ///< to a WebSocket
};

enum class Access { page, live, denied };

struct Answer {
  Access to = Access::denied;
  unsigned status = 200;  ///< of HTTP
  const char* words = "";
};

/// Allows GET of "/" (the page) and of "/live" (its WebSocket), with the token, from this computer under one of its own
/// names, from the page itself. The port may differ from the server's: an ssh tunnel.
[[nodiscard]] Answer authorize(const AccessRequest& request, std::string_view token);

/// 128 random bits, in 32 hexadecimal digits.
[[nodiscard]] std::string new_token();

}  // namespace kphi::daq::live
