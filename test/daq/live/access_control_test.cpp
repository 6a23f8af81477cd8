#include "daq/live/access_control.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kphi::daq::live {
namespace access_control_test {

constexpr const char* kToken = "0123456789abcdef0123456789abcdef";

AccessRequest visit(std::string_view target = "/?token=0123456789abcdef0123456789abcdef") {
  return {"GET", target, "127.0.0.1:8080", std::nullopt, false};
}

TEST(AccessControl, LetsInWhoKnowsTheToken) {
  EXPECT_EQ(authorize(visit(), kToken).to, Access::page);
  AccessRequest request = visit("/live?token=0123456789abcdef0123456789abcdef");
  request.upgrade = true;
  EXPECT_EQ(authorize(request, kToken).to, Access::live);
}

TEST(AccessControl, RefusesAWrongOrMissingToken) {
  for (const char* target :
       {"/", "/?", "/?token=", "/?token=0", "/?token=0123456789abcdef0123456789abcdee",
        "/?Token="
        "0123456789abcdef0123456789abcdef",
        "/?a=b&token=0123456789abcdef0123456789abcdef", "/live", "/live?token=0123456789abcdef0123456789abcdef0",
        "/live?token=0123456789abcdef0123456789abcdef&x=1"}) {
    EXPECT_EQ(authorize(visit(target), kToken).to, Access::denied) << target;
    EXPECT_EQ(authorize(visit(target), kToken).status, 403u) << target;
  }
}

TEST(AccessControl, RefusesAForeignHostEvenWithTheToken) {
  for (const char* host : {"evil.example", "evil.example:8080", "127.0.0.1.evil.example:8080", "localhost.evil.example",
                           "192.168.1.5:8080", "", ":8080", "127.0.0.11"}) {
    AccessRequest request = visit();
    request.host = host;
    EXPECT_EQ(authorize(request, kToken).status, 403u) << host;
  }
}

TEST(AccessControl, RefusesAForeignOriginEvenWithTheToken) {
  for (const char* origin :
       {"http://evil.example", "https://127.0.0.1:8080", "file://127.0.0.1:8080", "http://127.0.0.1:3000", "null", "",
        "http://127.0.0.1:8080.evil.example", "http://localhost:8080"}) {
    AccessRequest request = visit();
    request.origin = origin;
    EXPECT_EQ(authorize(request, kToken).status, 403u) << origin;
  }
}

TEST(AccessControl, AcceptsItsOwnPageAlsoThroughATunnel) {
  for (const char* host : {"127.0.0.1:8080", "localhost:8080", "localhost:9999", "localhost"}) {
    const std::string origin = std::string("http://") + host;
    AccessRequest request = visit();
    request.host = host;
    request.origin = origin;
    EXPECT_EQ(authorize(request, kToken).to, Access::page) << host;
  }
}

TEST(AccessControl, KnowsTwoPathsAndOneMethod) {
  EXPECT_EQ(authorize(visit("/stop?token=0123456789abcdef0123456789abcdef"), kToken).status, 404u);
  EXPECT_EQ(authorize(visit("http://127.0.0.1/?token=0123456789abcdef0123456789abcdef"), kToken).status, 404u);
  EXPECT_EQ(authorize(visit("/live?token=0123456789abcdef0123456789abcdef"), kToken).status, 426u);
  for (const char* method : {"POST", "HEAD", "OPTIONS", "PUT", "get"}) {
    AccessRequest request = visit();
    request.method = method;
    EXPECT_EQ(authorize(request, kToken).status, 405u) << method;
  }
}

/// A right answer to each of the gate's questions, and wrong ones.
template <class T>
struct Answers {
  std::vector<T> right, wrong;
  [[nodiscard]] std::vector<std::pair<T, bool>> all() const {
    std::vector<std::pair<T, bool>> all;
    for (const T& each : right) all.emplace_back(each, true);
    for (const T& each : wrong) all.emplace_back(each, false);
    return all;
  }
};

TEST(AccessControl, RefusesEveryCombinationInWhichAnythingIsWrong) {
  using Text = std::string_view;
  using Origin = std::optional<std::string_view>;
  constexpr Text kHost = "127.0.0.1:8080";
  const Answers<Text> methods{{"GET"}, {"POST", ""}};
  const Answers<Text> hosts{{kHost}, {"evil.example:8080", "127.0.0.1.evil.example", ""}};
  const Answers<Origin> origins{{std::nullopt, Origin("http://127.0.0.1:8080")},
                                {Origin("http://evil.example"), Origin("https://127.0.0.1:8080"),
                                 Origin("file://127.0.0.1:8080"), Origin("null"), Origin("")}};
  const Answers<std::pair<Text, bool>> paths{{{"/", false}, {"/", true}, {"/live", true}},
                                             {{"/live", false}, {"/stop", true}, {"/live/", true}, {"//", false}}};
  const Answers<Text> queries{{"?token=0123456789abcdef0123456789abcdef"},
                              {"?token=1123456789abcdef0123456789abcdef", "?token=0123456789abcdef0123456789abcdee",
                               "?token=0123456789abcdef", "?token=", "?", ""}};
  int admitted = 0, refused = 0;
  for (const auto& [method, method_is_right] : methods.all())
    for (const auto& [host, host_is_right] : hosts.all())
      for (const auto& [origin, origin_is_right] : origins.all())
        for (const auto& [path, path_is_right] : paths.all())
          for (const auto& [query, token_is_right] : queries.all()) {
            const std::string target = std::string(path.first) + std::string(query);
            const Answer answer = authorize({method, target, host, origin, path.second}, kToken);
            const bool right = method_is_right && host_is_right && origin_is_right && path_is_right && token_is_right;
            EXPECT_EQ(answer.to != Access::denied, right)
                << method << ' ' << target << " host " << host << " origin " << origin.value_or("(none)");
            EXPECT_EQ(answer.status < 400, right);
            ++(answer.to == Access::denied ? refused : admitted);
          }
  EXPECT_EQ(admitted, 2 * 3) << "of each origin: the page twice, its WebSocket once";
  EXPECT_EQ(refused, 3 * 4 * 7 * 7 * 7 - admitted);
}

TEST(AccessControl, DrawsAnotherTokenEveryTime) {
  std::set<std::string> tokens;
  for (int i = 0; i < 1000; ++i) tokens.insert(new_token());
  EXPECT_EQ(tokens.size(), 1000u);
  EXPECT_EQ(tokens.begin()->size(), 32u);
  EXPECT_EQ(tokens.begin()->find_first_not_of("0123456789abcdef"), std::string::npos);
}

}  // namespace access_control_test
}  // namespace kphi::daq::live
