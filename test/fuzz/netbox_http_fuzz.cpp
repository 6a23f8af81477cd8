// Any bytes as the answer of the box's web server, over a real socket: a body within the limit, or a DeviceError.
// Input: one byte says after how many bytes (times 8) the answer pauses; the rest is the answer.
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "base/error.hpp"
#include "drivers/netbox/configuration/http.hpp"
#include "test/fuzz/tokens.hpp"

namespace {

constexpr std::string_view kTokens[] = {"HTTP/1.0 200 OK\r\n",
                                        "HTTP/1.1 404 Not Found\r\n",
                                        "HTTP/1.0 100 Continue\r\n\r\n",
                                        "Content-Length: ",
                                        "Content-Length: 3\r\n\r\n",
                                        "Content-Length: 18446744073709551615\r\n\r\n",
                                        "Content-Length: 1048577\r\n\r\n",
                                        "Transfer-Encoding: chunked\r\n\r\n",
                                        "Connection: close\r\n",
                                        "ffffffffffffffff\r\n",
                                        "3\r\nabc\r\n0\r\n\r\n",
                                        "\r\n\r\n",
                                        "\r\n",
                                        "<netft></netft>"};

void require(bool condition) {
  if (!condition) std::abort();
}

/// Answers each connection with what it was given last.
class Web {
 public:
  Web() : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    socklen_t length = sizeof address;
    require(bind(listener_, reinterpret_cast<sockaddr*>(&address), length) == 0 && listen(listener_, 16) == 0 &&
            getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &length) == 0);
    port_ = ntohs(address.sin_port);
    std::thread([this] {
      for (;;) serve(accept(listener_, nullptr, nullptr));
    }).detach();
  }
  std::uint16_t port() const { return port_; }
  void will_say(std::string answer, std::size_t pause_at) {
    const std::lock_guard lock(mutex_);
    answer_ = std::move(answer);
    pause_at_ = pause_at;
  }

 private:
  void serve(int client) {
    std::string request;
    char bytes[512];
    while (request.find("\r\n\r\n") == std::string::npos) {
      const ssize_t count = recv(client, bytes, sizeof bytes, 0);
      if (count <= 0) break;
      request.append(bytes, static_cast<std::size_t>(count));
    }
    const auto [answer, pause_at] = told();
    const std::size_t first = std::min(pause_at, answer.size());
    send(client, answer.data(), first, MSG_NOSIGNAL);
    if (first < answer.size()) {
      usleep(50);
      send(client, answer.data() + first, answer.size() - first, MSG_NOSIGNAL);
    }
    shutdown(client, SHUT_WR);
    while (recv(client, bytes, sizeof bytes, 0) > 0) {
    }
    close(client);
  }

  std::pair<std::string, std::size_t> told() {
    const std::lock_guard lock(mutex_);
    return {answer_, pause_at_};
  }

  int listener_;
  std::uint16_t port_ = 0;
  std::mutex mutex_;
  std::string answer_;
  std::size_t pause_at_ = 0;
};

/// Another address of loopback each time: the ports of one would run out.
std::string next_host() {
  static unsigned count = 0;
  ++count;
  return "127." + std::to_string(count >> 16 & 0xff) + "." + std::to_string(count >> 8 & 0xff) + "." +
         std::to_string((count & 0xff) % 254 + 1);
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max, unsigned seed) {
  return kphi::test::mutate_with(kTokens, data, size, max, seed);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Web& web = *new Web;
  if (size < 1) return 0;
  web.will_say({reinterpret_cast<const char*>(data) + 1, size - 1}, data[0] * std::size_t{8});
  try {
    const std::string body = kphi::netbox::http_get(next_host(), web.port(), "/netftapi2.xml", std::chrono::seconds(4));
    require(body.size() <= size);
  } catch (const kphi::DeviceError& error) {
    require(std::string_view(error.what()).find("no answer within") == std::string_view::npos);
  }
  return 0;
}
