#include "drivers/netbox/configuration/interfaces.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include <algorithm>
#include <bit>
#include <memory>
#include <optional>

namespace kphi::netbox {
namespace {

constexpr std::uint32_t kLoopback = 127;

std::uint32_t number_of(const sockaddr* address) {
  return ntohl(reinterpret_cast<const sockaddr_in*>(address)->sin_addr.s_addr);
}

std::string dotted(std::uint32_t address) {
  return fmt::format("{}.{}.{}.{}", address >> 24, address >> 16 & 255, address >> 8 & 255, address & 255);
}

std::optional<std::uint32_t> parse(const std::string& host) {
  in_addr address{};
  if (inet_pton(AF_INET, host.c_str(), &address) != 1) return std::nullopt;
  return ntohl(address.s_addr);
}

}  // namespace

std::string Interface::text() const { return fmt::format("{}/{} on {}", dotted(address), prefix, name); }

bool Interface::is_near(std::uint32_t other) const noexcept {
  return prefix == 0 || (address ^ other) >> (32 - prefix) == 0;
}

std::vector<Interface> interfaces() {
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0) return {};
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> all(first, &freeifaddrs);
  std::vector<Interface> found;
  for (const ifaddrs* one = first; one != nullptr; one = one->ifa_next) {
    const bool is_up = (one->ifa_flags & IFF_UP) != 0 && (one->ifa_flags & IFF_LOOPBACK) == 0;
    if (!is_up || one->ifa_addr == nullptr || one->ifa_netmask == nullptr || one->ifa_addr->sa_family != AF_INET)
      continue;
    found.push_back({one->ifa_name, number_of(one->ifa_addr), std::popcount(number_of(one->ifa_netmask))});
  }
  return found;
}

std::string advice_to_reach(const std::string& host, const std::vector<Interface>& own) {
  const std::optional<std::uint32_t> wanted = parse(host);
  if (!wanted || *wanted >> 24 == kLoopback) return "";
  if (std::ranges::any_of(own, [&](const Interface& card) { return card.is_near(*wanted); })) return "";
  std::vector<std::string> texts;
  for (const Interface& card : own) texts.push_back(card.text());
  const std::uint32_t neighbour = (*wanted & ~255u) | ((*wanted & 255) == 100 ? 101 : 100);
  return fmt::format(
      "this computer has {}, none in the network of {}: give the card of its cable an address such as {}/24",
      texts.empty() ? "no network address" : fmt::format("{}", fmt::join(texts, " and ")), host, dotted(neighbour));
}

}  // namespace kphi::netbox
