#include "daq/live/server.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <poll.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "base/error.hpp"
#include "daq/live/messages.hpp"
#include "test/soon.hpp"

namespace kphi::daq::live {
namespace server_test {

namespace asio = boost::asio;
namespace websocket = boost::beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;
using kphi::test::soon;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using testing::ThrowsMessage;
using namespace std::chrono_literals;

const std::string kToken = "0123456789abcdef0123456789abcdef";
const std::string kPage = "/?token=" + kToken, kLive = "/live?token=" + kToken;

/// A page's WebSocket, as a stranger's program would open it.
class Onlooker {
 public:
  Onlooker(std::uint16_t port, const std::string& target, const std::string& host, const std::string& origin,
           int receive_buffer = 0)
      : stream_(io_) {
    tcp::socket& socket = stream_.next_layer();
    socket.open(tcp::v4());
    if (receive_buffer > 0) socket.set_option(asio::socket_base::receive_buffer_size(receive_buffer));
    socket.connect({asio::ip::address_v4::loopback(), port});
    stream_.set_option(websocket::stream_base::decorator([&](websocket::request_type& request) {
      if (!origin.empty()) request.set(boost::beast::http::field::origin, origin);
    }));
    stream_.handshake(host, target, refusal_);
  }
  [[nodiscard]] bool is_in() const { return !refusal_; }
  void say(const std::string& word) {
    error_code ignored;
    stream_.write(asio::buffer(word), ignored);
  }
  void begin_to_say(const std::string& part) {
    error_code ignored;
    stream_.write_some(false, asio::buffer(part), ignored);
  }
  /// Has heard all that was before it came.
  void catch_up() { (void)hear("history"); }
  /// The next message; discarded when the server has closed.
  json hear() {
    boost::beast::flat_buffer bytes;
    error_code failed;
    stream_.read(bytes, failed);
    if (failed) return json(json::value_t::discarded);
    return json::parse(boost::beast::buffers_to_string(bytes.data()));
  }
  json hear(const std::string& type) {
    for (;;) {
      json message = hear();
      if (message.is_discarded() || message["type"] == type) return message;
    }
  }

 private:
  asio::io_context io_;
  websocket::stream<tcp::socket> stream_;
  error_code refusal_;
};

class LiveServer : public testing::Test {
 protected:
  void start(const std::function<void(Server::Settings&)>& change = [](auto&) {}) {
    Server::Settings settings;
    settings.token = kToken;
    settings.page = page_text();
    settings.hello = hello_message({});
    settings.frame = 0ms;
    change(settings);
    server_ = std::make_unique<Server>(settings, feed_);
  }
  [[nodiscard]] std::string here() const { return fmt::format("127.0.0.1:{}", server_->port()); }
  std::unique_ptr<Onlooker> onlooker(int receive_buffer = 0) {
    return std::make_unique<Onlooker>(server_->port(), kLive, here(), "http://" + here(), receive_buffer);
  }
  std::unique_ptr<Onlooker> caught_up() {
    auto page = onlooker();
    page->catch_up();
    return page;
  }
  void show(double time_s) {
    Tick tick;
    tick.time_s = time_s;
    feed_.show(tick);
  }
  void draw(double time_s) {
    show(time_s);
    server_->draw();
  }
  tcp::socket connected() {
    tcp::socket socket(io_);
    socket.connect({asio::ip::address_v4::loopback(), server_->port()});
    return socket;
  }
  /// Everything that is answered to these bytes.
  std::string answer_to(const std::string& bytes) {
    tcp::socket socket = connected();
    error_code ignored;
    asio::write(socket, asio::buffer(bytes), ignored);
    std::string answer;
    asio::read(socket, asio::dynamic_buffer(answer), ignored);
    return answer;
  }
  std::string get(const std::string& target, const std::string& more = "") {
    return answer_to(fmt::format("GET {} HTTP/1.1\r\nHost: {}\r\n{}\r\n", target, here(), more));
  }
  /// The first line of what is answered to one who asks for the WebSocket and is refused.
  std::string refusal_of(const std::string& token, const std::string& host, const std::string& origin) {
    const std::string answer = answer_to(fmt::format(
        "GET /live?token={} HTTP/1.1\r\nHost: {}\r\nOrigin: {}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
        token, host, origin));
    return answer.substr(0, answer.find('\r'));
  }

  asio::io_context io_;
  Feed feed_;
  std::unique_ptr<Server> server_;
};

TEST(ServerSettings, AreTwentyFramesASecond) {
  EXPECT_GT(Server::Settings{}.frame.count(), 0);
  EXPECT_LE(20 * Server::Settings{}.frame, 1s);
}

TEST_F(LiveServer, GivesThePageToWhoKnowsTheTokenAndLetsItLoadNothingAndRunOnlyItsOwnScripts) {
  start();
  EXPECT_EQ(server_->url(), fmt::format("http://{}{}", here(), kPage));
  const std::string answer = get(kPage), again = get(kPage);
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
  const auto policy = [](const std::string& text) {
    const std::size_t at = text.find("Content-Security-Policy");
    return text.substr(at, text.find("\r\n", at) - at);
  };
  EXPECT_THAT(policy(answer), HasSubstr("default-src 'none'; script-src 'nonce-"));
  EXPECT_NE(policy(answer), policy(again)) << "a nonce is used once";
  EXPECT_THAT(answer,
              AllOf(HasSubstr("</html>"), HasSubstr("Referrer-Policy: no-referrer"), Not(HasSubstr("@NONCE@"))));
}

TEST_F(LiveServer, RefusesAWrongOrMissingTokenAndForeignOriginsAndHosts) {
  start();
  const std::string wrong = "0123456789abcdef0123456789abcdee", own = "http://" + here();
  EXPECT_THAT(get("/"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(get("/?token=" + wrong), StartsWith("HTTP/1.1 403"));
  const std::string foreign = fmt::format("evil.example:{}", server_->port());
  for (const auto& [token, host, origin] :
       std::vector<std::array<std::string, 3>>{{"", here(), own},
                                               {wrong, here(), own},
                                               {kToken, here(), "http://evil.example"},
                                               {kToken, here(), "null"},
                                               {kToken, foreign, "http://" + foreign}})
    EXPECT_EQ(refusal_of(token, host, origin), "HTTP/1.1 403 Forbidden") << host << " " << origin;
  EXPECT_EQ(server_->clients(), 0u);
  EXPECT_FALSE(Onlooker(server_->port(), kLive, here(), "http://evil.example").is_in());
  EXPECT_TRUE(Onlooker(server_->port(), kLive, here(), "").is_in()) << "a program, which sends no Origin";
}

TEST_F(LiveServer, RefusesWhatIsNoPlainGet) {
  start();
  EXPECT_THAT(answer_to(fmt::format("POST {} HTTP/1.1\r\nHost: {}\r\n\r\n", kPage, here())),
              StartsWith("HTTP/1.1 405"));
  EXPECT_THAT(get(kPage, "Content-Length: 5\r\n"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(get(kPage, "Origin: http://" + here() + "\r\nOrigin: http://evil.example\r\n"),
              StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(get("/../etc/passwd?token=" + kToken), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(answer_to("\x16\x03\x01 no http at all\r\n\r\n"), StartsWith("HTTP/1.1 400"));
}

TEST_F(LiveServer, RefusesARequestThatIsTooLong) {
  start();
  const std::string answer = get(kPage, "X: " + std::string(100'000, 'x') + "\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 431"));
  const std::string longest(Server::kLongestHeader - 300, 'x');
  EXPECT_THAT(get(kPage, "X: " + longest + "\r\n"), StartsWith("HTTP/1.1 200"));
}

TEST_F(LiveServer, IsNotBlockedByConnectionsThatAskNothing) {
  start([](Server::Settings& settings) { settings.request_limit = std::chrono::hours(1); });
  std::vector<tcp::socket> idle;
  for (std::size_t i = 0; i < 3 * Server::kMostRequests; ++i) {
    idle.push_back(connected());
    if (i % 16 == 0) {
      EXPECT_THAT(get(kPage), StartsWith("HTTP/1.1 200")) << i;
    }
  }
  pollfd oldest{idle.front().native_handle(), POLLIN, 0};
  ASSERT_EQ(::poll(&oldest, 1, 10'000), 1) << "the oldest gave way";
  char byte = 0;
  error_code closed;
  (void)asio::read(idle.front(), asio::buffer(&byte, 1), closed);
  EXPECT_EQ(closed, asio::error::eof) << "the oldest gave way";
}

TEST_F(LiveServer, ReadsOnlySoMuchOfARequestThatItHasRefused) {
  start([](Server::Settings& settings) { settings.request_limit = std::chrono::hours(1); });
  tcp::socket socket = connected();
  const std::string piece(1 << 20, 'x');
  error_code failed;
  for (int megabytes = 0; megabytes < 64 && !failed; ++megabytes) asio::write(socket, asio::buffer(piece), failed);
  EXPECT_TRUE(failed) << "64 MB were taken";
}

TEST_F(LiveServer, ClosesOnWhoNeverFinishesARequest) {
  start([](Server::Settings& settings) { settings.request_limit = 50ms; });
  EXPECT_THAT(answer_to("GET / HTTP/1.1\r\nHo"), Not(HasSubstr(" 200 ")));  // returns when the server closes
}

TEST_F(LiveServer, SendsOneTickPerFrameToWhoReads) {
  start();
  const auto page = onlooker();
  EXPECT_EQ(page->hear()["type"], "hello");
  EXPECT_EQ(page->hear()["type"], "history");
  for (int i = 1; i <= 60; ++i) {
    draw(i);
    const json tick = page->hear();
    ASSERT_EQ(tick["type"], "tick");
    EXPECT_EQ(tick["time_s"], i);
  }
}

TEST_F(LiveServer, SendsFramesByItself) {
  start([](Server::Settings& settings) { settings.frame = 33ms; });
  show(1);
  const auto page = onlooker();
  for (int i = 0; i < 3; ++i) EXPECT_EQ(page->hear("tick")["time_s"], 1);
}

TEST_F(LiveServer, TellsWhoComesLateWhatWas) {
  start();
  const auto first = caught_up();
  feed_.tell(line_message(1, "the first line"));
  feed_.tell(step_message({}, {}));
  for (const double limit : {3.0, 2.0})
    feed_.tell(limits_message({{Watched::thrust, "thrust", limit, "N", "campaign"}}));
  for (int i = 1; i <= 2; ++i) {
    draw(i);
    (void)first->hear("tick");
  }
  const json history = onlooker()->hear("history");
  EXPECT_EQ(history["trace"].size(), 2u);
  ASSERT_EQ(history["messages"].size(), 3u);
  EXPECT_EQ(history["messages"][0]["limits"][0]["limit"], 2) << "the newest table only";
  EXPECT_EQ(history["messages"][1]["type"], "step");
  EXPECT_EQ(history["messages"][2]["text"], "the first line");
}

TEST_F(LiveServer, AsksForTheStopExactlyOnce) {
  start();
  const auto page = caught_up(), other = caught_up();
  EXPECT_FALSE(feed_.stop_asked());
  for (int i = 0; i < 3; ++i) page->say("stop");
  EXPECT_EQ(page->hear()["type"], "stop");
  EXPECT_EQ(other->hear()["type"], "stop") << "every page is told";
  EXPECT_TRUE(feed_.stop_asked());
  other->say("stop");
  draw(1);
  EXPECT_EQ(page->hear()["type"], "tick") << "it is confirmed once";
  EXPECT_FALSE(feed_.ask_stop());
}

TEST_F(LiveServer, StopsNothingThatIsOnlyReplayed) {
  start([](Server::Settings& settings) { settings.can_stop = false; });
  const auto page = caught_up();
  page->say("stop");
  draw(1);
  EXPECT_EQ(page->hear()["type"], "tick");
  EXPECT_FALSE(feed_.stop_asked());
}

TEST_F(LiveServer, TakesKeysOnlyWhereTheMotorIsTurnedByHand) {
  start([](Server::Settings& settings) { settings.can_steer = true; });
  const auto page = caught_up();
  for (const char* word : {"up", "hold", "down"}) page->say(word);
  page->say("stop");
  EXPECT_EQ(page->hear()["type"], "stop") << "after them";
  EXPECT_EQ(feed_.take_key(), Key::up);
  EXPECT_EQ(feed_.take_key(), Key::hold);
  EXPECT_EQ(feed_.take_key(), Key::down);
  EXPECT_EQ(feed_.take_key(), std::nullopt);
}

TEST_F(LiveServer, DropsWhoSteersARun) {
  start();
  const auto page = caught_up();
  page->say("up");
  EXPECT_TRUE(page->hear().is_discarded());
  EXPECT_EQ(feed_.take_key(), std::nullopt);
}

TEST_F(LiveServer, DropsWhoSaysAnythingElse) {
  start();
  for (const std::string& word : {std::string("Stop"), std::string("stop "), std::string(), std::string("{}"),
                                  "stop" + std::string(1'000'000, ' ')}) {
    const auto page = caught_up();
    page->say(word);
    EXPECT_TRUE(page->hear().is_discarded()) << word.substr(0, 20);
  }
  const auto next = onlooker();
  EXPECT_EQ(next->hear()["type"], "hello");
  EXPECT_EQ(server_->clients(), 1u) << "the server has one thread: the others have left before";
  EXPECT_FALSE(feed_.stop_asked());
}

TEST_F(LiveServer, DoesNotWaitForTheEndOfAWordThatIsTooLong) {
  start();
  const auto page = caught_up();
  page->begin_to_say(std::string(65, 's'));
  double time_s = 0;
  EXPECT_TRUE(soon([&] { return draw(++time_s), page->hear().is_discarded(); }, 5s));
}

TEST_F(LiveServer, ServesManyPagesAndRefusesOneTooMany) {
  start([](Server::Settings& settings) { settings.most_clients = 8; });
  std::vector<std::unique_ptr<Onlooker>> pages;
  for (int i = 0; i < 8; ++i) pages.push_back(caught_up());
  EXPECT_EQ(refusal_of(kToken, here(), "http://" + here()), "HTTP/1.1 503 Service Unavailable");
  draw(7);
  for (const auto& page : pages) EXPECT_EQ(page->hear()["time_s"], 7);
  pages.pop_back();
  EXPECT_TRUE(soon([&] {
    server_->draw();
    return !pages.front()->hear("tick").is_discarded() && server_->clients() == 7;
  }));
  EXPECT_TRUE(onlooker()->is_in()) << "a place was left";
}

TEST_F(LiveServer, DropsAClientThatDoesNotReadWhileTheOthersGetEveryFrame) {
  start([](Server::Settings& settings) { settings.patience = 200ms; });
  const auto slow = onlooker(4096), quick = caught_up();
  int frame = 0;
  EXPECT_TRUE(soon([&] {
    draw(++frame);
    EXPECT_EQ(quick->hear()["time_s"], frame) << "the others get every frame";
    return server_->clients() == 1;
  }));
}

TEST_F(LiveServer, DropsAClientBehindWhichTooManyMessagesWait) {
  start([](Server::Settings& settings) { settings.most_waiting = 20; });
  const auto slow = onlooker(4096), quick = caught_up();
  const std::string words(1000, 'x');
  EXPECT_TRUE(soon([&] {
    feed_.tell(line_message(1, words));
    server_->draw();
    EXPECT_EQ(quick->hear()["text"], words);
    return server_->clients() == 1;
  }));
}

TEST_F(LiveServer, NeverMakesTheRunnerWaitEvenWhenItStandsStill) {
  start([](Server::Settings& settings) { settings.frame = std::chrono::hours(1); });
  for (int i = 0; i < 100'000; ++i)
    show(i), feed_.tell({Message::Kind::other, "{}"});  // returns: nobody takes anything
  EXPECT_GT(feed_.dropped(), 90'000u);
}

TEST_F(LiveServer, DeliversTheLastWordsBeforeItGoes) {
  start();
  const auto page = caught_up();
  show(3);
  feed_.tell(end_message(3, false, true, "stopped by request; coasted"));
  std::thread going([&] { server_.reset(); });
  const json end = page->hear("end");
  EXPECT_EQ(end["text"], "stopped by request; coasted");
  EXPECT_EQ(end["at_rest"], true);
  while (!page->hear().is_discarded()) {
  }
  going.join();
}

TEST_F(LiveServer, IsGoneSoonWhenAClientDoesNotRead) {
  start();
  const auto slow = onlooker(4096);
  for (int i = 0; i < 2000; ++i) {
    feed_.tell(line_message(1, std::string(500, 'x')));
    if (i % 100 == 0) server_->draw();
  }
  server_.reset();  // returns
}

TEST_F(LiveServer, SaysThatAPortIsTaken) {
  start();
  Feed feed;
  Server::Settings settings;
  settings.port = server_->port();
  EXPECT_THAT([&] { const Server other(settings, feed); },
              ThrowsMessage<ConfigurationError>(HasSubstr("give another port")))
      << "two servers on one port";
}

TEST(LivePage, IsOneTextThatNamesNoOtherPlace) {
  const std::string page = page_text();
  for (const char* left : {"@app.js@", "@style.css@", "@dygraph.min.js@", "@dygraph.min.css@", "sourceMappingURL",
                           "src=\"http", "href=\"http", "url(http", "@import"}) {
    EXPECT_THAT(page, Not(HasSubstr(left)));
  }
  EXPECT_THAT(page, HasSubstr("Dygraph"));
}

}  // namespace server_test
}  // namespace kphi::daq::live
