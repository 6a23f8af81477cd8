// Who may come in. Pages of other sites can make a browser ask for anything at 127.0.0.1, under a name of their own
// even (DNS rebinding); what they cannot do is know the token, or lie about Host and Origin.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace kphi::daq::live {

/// What a request says of itself.
struct Knock {
  std::string_view method;
  std::string_view target;  ///< "/?token=…"
  std::string_view host;
  std::optional<std::string_view> origin;  ///< absent: no browser, or a plain visit
  bool upgrade = false;                    ///< to a WebSocket
};

enum class Admitted { page, live, nowhere };

struct Answer {
  Admitted to = Admitted::nowhere;
  unsigned status = 200;  ///< of HTTP
  const char* words = "";
};

/// GET of "/" (the page) and of "/live" (its WebSocket), with the token, from this machine under one of its own names,
/// from the page itself. The port may differ from ours: an ssh tunnel.
[[nodiscard]] Answer admit(const Knock& knock, std::string_view token);

/// 128 random bits, in 32 hexadecimal digits.
[[nodiscard]] std::string new_token();

}  // namespace kphi::daq::live
