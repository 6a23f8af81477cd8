#include "daq/live/access_control.hpp"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/rand.h>

#include <array>
#include <stdexcept>

namespace kphi::daq::live {
namespace {

bool is_own_name(std::string_view host) {
  const std::string_view name = host.substr(0, host.find(':'));
  return name == "127.0.0.1" || name == "localhost";
}

bool is_own_page(std::string_view origin, std::string_view host) { return origin == "http://" + std::string(host); }

/// Takes as long for a wrong token as for the right one.
bool is_token(std::string_view said, std::string_view token) {
  return said.size() == token.size() && CRYPTO_memcmp(said.data(), token.data(), token.size()) == 0;
}

std::string_view token_in(std::string_view query) {
  constexpr std::string_view kKey = "token=";
  return query.substr(0, kKey.size()) == kKey ? query.substr(kKey.size()) : std::string_view();
}

}  // namespace

Answer authorize(const AccessRequest& request, std::string_view token) {
  if (request.method != "GET") return {Access::denied, 405, "only GET"};
  if (!is_own_name(request.host)) return {Access::denied, 403, "the Host header names another computer"};
  if (request.origin && !is_own_page(*request.origin, request.host))
    return {Access::denied, 403, "a page of another origin sent this request"};
  const std::size_t mark = request.target.find('?');
  const std::string_view path = request.target.substr(0, mark);
  if (path != "/" && path != "/live") return {Access::denied, 404, "no such page"};
  const std::string_view query = mark == std::string_view::npos ? std::string_view() : request.target.substr(mark + 1);
  if (!is_token(token_in(query), token))
    return {Access::denied, 403, "wrong or missing token: open the address that kphi printed when it started"};
  if (path == "/") return {Access::page, 200, ""};
  if (!request.upgrade) return {Access::denied, 426, "WebSocket only"};
  return {Access::live, 101, ""};
}

std::string new_token() {
  std::array<unsigned char, 16> random{};
  if (RAND_bytes(random.data(), random.size()) != 1) throw std::runtime_error("live view: no random numbers available");
  return fmt::format("{:02x}", fmt::join(random, ""));
}

}  // namespace kphi::daq::live
