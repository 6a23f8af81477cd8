#include "daq/live/access_control.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kphi::daq::live {
namespace access_control_test {

constexpr std::string_view kToken = "0123456789abcdef0123456789abcdef";
constexpr std::string_view kHost = "127.0.0.1:8080";

TEST(AccessControl, AcceptsItsOwnPageAlsoThroughATunnel) {
  for (const char* host : {"127.0.0.1:8080", "localhost:8080", "localhost:9999", "localhost"}) {
    const std::string origin = std::string("http://") + host, target = "/?token=" + std::string(kToken);
    EXPECT_EQ(authorize({"GET", target, host, origin, false}, kToken).to, Access::page) << host;
  }
}

/// What is right of one part of a request, and what is wrong with the status that says so.
template <class T>
using Answers = std::vector<std::pair<T, unsigned>>;

TEST(AccessControl, RefusesEveryCombinationInWhichAnythingIsWrong) {
  using Text = std::string_view;
  using Origin = std::optional<std::string_view>;
  const Answers<Text> methods{{"GET", 0},   {"POST", 405}, {"HEAD", 405}, {"OPTIONS", 405},
                              {"PUT", 405}, {"get", 405},  {"", 405}};
  Answers<Text> hosts{{kHost, 0}};
  for (const char* host : {"evil.example", "evil.example:8080", "127.0.0.1.evil.example", "127.0.0.1.evil.example:8080",
                           "localhost.evil.example", "192.168.1.5:8080", "", ":8080", "127.0.0.11"})
    hosts.emplace_back(host, 403);
  Answers<Origin> origins{{std::nullopt, 0}, {"http://127.0.0.1:8080", 0}};
  for (const char* origin :
       {"http://evil.example", "https://127.0.0.1:8080", "file://127.0.0.1:8080", "http://127.0.0.1:3000", "null", "",
        "http://127.0.0.1:8080.evil.example", "http://localhost:8080"})
    origins.emplace_back(origin, 403);
  const Answers<std::pair<Text, bool>> paths{
      {{"/", false}, 0},       {{"/", true}, 0},       {{"/live", true}, 0},
      {{"/live", false}, 426}, {{"/stop", true}, 404}, {{"/stop", false}, 404},
      {{"/live/", true}, 404}, {{"//", false}, 404},   {{"http://127.0.0.1/", false}, 404}};
  Answers<Text> queries{{"?token=0123456789abcdef0123456789abcdef", 0}};
  for (const char* query : {"?token=1123456789abcdef0123456789abcdef", "?token=0123456789abcdef0123456789abcdee",
                            "?token=0123456789abcdef0123456789abcdef0", "?token=0123456789abcdef0123456789abcdef&x=1",
                            "?Token=0123456789abcdef0123456789abcdef", "?a=b&token=0123456789abcdef0123456789abcdef",
                            "?token=0123456789abcdef", "?token=0", "?token=", "?", ""})
    queries.emplace_back(query, 403);
  int admitted = 0;
  for (const auto& [method, wrong_method] : methods)
    for (const auto& [host, wrong_host] : hosts)
      for (const auto& [origin, wrong_origin] : origins)
        for (const auto& [path, wrong_path] : paths)
          for (const auto& [query, wrong_token] : queries) {
            const std::string target = std::string(path.first) + std::string(query);
            const Answer answer = authorize({method, target, host, origin, path.second}, kToken);
            const auto wrong = {wrong_method, wrong_host, wrong_origin, wrong_path == 404 ? 404u : 0u,
                                wrong_token,  wrong_path};
            const auto first = std::find_if(wrong.begin(), wrong.end(), [](unsigned status) { return status > 0; });
            const bool live = path.first == "/live";
            ASSERT_EQ(answer.status, first != wrong.end() ? *first
                                     : live               ? 101
                                                          : 200)
                << method << ' ' << target << " host " << host << " origin " << origin.value_or("(none)");
            ASSERT_EQ(answer.to, first != wrong.end() ? Access::denied : live ? Access::live : Access::page);
            admitted += answer.to != Access::denied;
          }
  EXPECT_EQ(admitted, 2 * 3) << "of each origin: the page twice, its WebSocket once";
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
