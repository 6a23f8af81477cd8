#include "drivers/netbox/configuration/http.hpp"

#include <gmock/gmock.h>

#include <atomic>

#include "test/drivers/netbox/fake_box.hpp"
#include "test/refusal.hpp"

namespace kphi::netbox::http_test {

using namespace std::chrono_literals;
using test::FakeWeb;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::string failure(std::uint16_t port, std::chrono::nanoseconds timeout = 10s) {
  return refusal([&] { return http_get("127.0.0.1", port, "/netftapi2.xml", timeout); });
}

TEST(HttpGet, ReturnsTheBodyAndAsksForNothingElse) {
  std::string request;
  {
    FakeWeb web(FakeWeb::page("<netft/>"));
    EXPECT_EQ(http_get("127.0.0.1", web.port(), "/netftapi2.xml", 10s), "<netft/>");
    request = web.last_request();
  }
  EXPECT_THAT(request, StartsWith("GET /netftapi2.xml HTTP/1.0\r\n"));
}

TEST(HttpGet, TakesAnAnswerInPiecesAndWithoutALengthUpToTheEnd) {
  for (const FakeWeb::Manner& manner :
       {FakeWeb::Manner{{"HTTP/1.0 200 OK\r\n\r\n<net", "ft/>"}},
        {{"HTTP/1.", "0 200 O", "K\r\nContent-Le", "ngth: 8\r\n\r", "\n<netft", "/>"}, 2ms}})
    EXPECT_EQ(http_get("127.0.0.1", FakeWeb(manner).port(), "/", 10s), "<netft/>");
}

TEST(HttpGet, TakesWhatATerseWebServerSays) {
  for (const char* answer : {"HTTP/1.0 200 OK\n\n<netft/>", "HTTP/1.0 200\r\n\r\n<netft/>", "HTTP/1.0 200\n\n<netft/>",
                             "HTTP/1.0 200 OK\nContent-Length: 8\n\n<netft/>",
                             "HTTP/1.0 200 OK\r\nContent Type: text/xml\r\nServer : box\r\n\r\n<netft/>"}) {
    EXPECT_EQ(http_get("127.0.0.1", FakeWeb({{answer}}).port(), "/", 10s), "<netft/>") << answer;
  }
}

TEST(HttpGet, AResetBehindTheBodyIsAnEnd) {
  for (const char* answer :
       {"HTTP/1.0 200 OK\r\n\r\n<netft/>", "HTTP/1.0 200 OK\r\nContent-Length: 8\r\n\r\n<netft/>"}) {
    FakeWeb::Manner manner{{answer}};
    manner.reset = true;
    EXPECT_EQ(http_get("127.0.0.1", FakeWeb(manner).port(), "/", 10s), "<netft/>") << answer;
  }
  FakeWeb::Manner early{{"HTTP/1.0 200 OK\r\nContent-Length: 100\r\n\r\n<netft"}};
  early.reset = true;
  EXPECT_THAT(failure(FakeWeb(early).port()), HasSubstr("reset"));
}

TEST(HttpGet, NamesTheStatusOfARefusal) {
  FakeWeb missing(FakeWeb::page("no", "404 Not Found"));
  EXPECT_THAT(failure(missing.port()), AllOf(HasSubstr("Net Box 127.0.0.1:"), HasSubstr("GET /netftapi2.xml"),
                                             HasSubstr("HTTP status 404"), HasSubstr("check that this is a Net Box")));
  FakeWeb broken(FakeWeb::page("no", "500 Internal Server Error"));
  EXPECT_THAT(failure(broken.port()), HasSubstr("HTTP status 500"));
}

TEST(HttpGet, ASlowBoxEndsInATimeoutNotInWaiting) {
  FakeWeb web({{"HTTP/1.0 200 OK\r\n", "\r\n"}, 60s});
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_THAT(failure(web.port(), 50ms), AllOf(HasSubstr("no answer within 0.1 s"), HasSubstr("read the answer")));
  EXPECT_LT(std::chrono::steady_clock::now() - begun, 10s);
}

TEST(HttpGet, WhatIsNoWholeAnswerIsNamed) {
  const std::string cut = "HTTP/1.0 200 OK\r\nContent-Length: 100\r\n\r\n<netft>";
  for (const auto& [manner, words] : std::vector<std::pair<FakeWeb::Manner, const char*>>{
           {{{cut}}, "could not read the answer: the connection ended early"},
           {{}, "could not read the answer: the connection ended early"},
           {{{cut}, 0ms, true}, "no answer within"},
           {{{"HTTP/1.0 200 OK\r\nContent-Length: 9999999999999999\r\n\r\nabc"}}, "the answer is longer than 1 MiB"},
           {{{"SSH-2.0-OpenSSH_9.2\r\n\r\n"}}, "not a Net Box"},
           {{{"HTTP/1.0 200 OK\r\nX: " + std::string(9000, 'x')}}, "not a Net Box"}}) {
    const FakeWeb web(manner);
    EXPECT_THAT(failure(web.port(), manner.keep_open ? 50ms : 10s), HasSubstr(words));
  }
}

TEST(HttpGet, AnAnswerAboveOneMebibyteIsRefused) {
  const std::string page(1 << 16, 'x');
  std::vector<std::string> pieces{"HTTP/1.0 200 OK\r\n\r\n"};
  for (int i = 0; i < 17; ++i) pieces.push_back(page);
  FakeWeb web({pieces});
  EXPECT_THAT(failure(web.port()), HasSubstr("not a Net Box"));
}

TEST(HttpGet, JustUnderOneMebibyteIsTaken) {
  FakeWeb web(FakeWeb::page(std::string((1 << 20) - 1, 'x')));
  EXPECT_EQ(http_get("127.0.0.1", web.port(), "/", 10s).size(), (1u << 20) - 1);
}

TEST(HttpGet, AClosedPortIsNamed) {
  const test::LoopbackSocket closed(SOCK_STREAM);  // bound, not listening
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_THAT(failure(closed.port()), AllOf(HasSubstr("could not connect"), HasSubstr("no web server on port"),
                                            HasSubstr("times in 1."), Not(HasSubstr("close the box's web pages"))));
  EXPECT_GE(std::chrono::steady_clock::now() - begun, kRefusedFor - 400ms);
}

/// What a box does that was asked too often, and then answers.
TEST(HttpGet, ARefusalIsAskedAgain) {
  for (const char* refusal : {"", "HTTP/1.0 503 Service Unavailable\r\n\r\n", "HTTP/1.0 429 Too Many\r\n\r\n"}) {
    std::atomic<int> asked{0};
    FakeWeb::Manner manner;
    manner.answer = [&](const std::string&) {
      return ++asked < 3 ? std::string(refusal) : "HTTP/1.0 200 OK\r\n\r\n<netft/>";
    };
    const FakeWeb web(manner);
    EXPECT_EQ(http_get("127.0.0.1", web.port(), "/", 10s), "<netft/>") << refusal;
    EXPECT_EQ(asked, 3);
  }
}

TEST(HttpGet, ABoxThatGoesOnRefusingIsNamedWithHowOftenItWasAsked) {
  FakeWeb web(FakeWeb::page("", "503 Service Unavailable"));
  EXPECT_THAT(failure(web.port()), AllOf(HasSubstr("HTTP status 503, 5 times in 1."), HasSubstr("other programs")));
  EXPECT_THAT(failure(web.port(), 100ms), Not(HasSubstr("times"))) << "there was no time for another question";
}

TEST(HttpGet, AnUnknownNameIsNamed) {
  EXPECT_THAT(refusal([&] { return http_get("no such host", 80, "/", 10s); }), HasSubstr("look up the name"));
}

}  // namespace kphi::netbox::http_test
