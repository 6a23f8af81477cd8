#include "daq/live/server.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <boost/algorithm/string/replace.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <list>
#include <set>
#include <thread>

#include "base/error.hpp"
#include "daq/live/access_control.hpp"
#include "daq/live/messages.hpp"

namespace kphi::daq::live {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using Text = std::shared_ptr<const std::string>;
using Error = boost::system::error_code;
using Wall = std::chrono::steady_clock;

constexpr int kYielding = 10;  // nice value of this thread
constexpr int kSendBuffer = 1 << 16;
constexpr std::chrono::milliseconds kClosingLimit{500};
constexpr std::chrono::seconds kIdle{20};

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

}  // namespace

/// Everything except draw() and clients() belongs to its thread.
struct Server::Impl {
  class Request;
  class Client;

  Impl(Settings settings, Feed& feed) : settings_(std::move(settings)), feed_(feed) {
    listen();
    accept();
    arm();
    thread_ = std::thread([this] { run(); });
  }

  ~Impl() {
    asio::post(io_, [this] { begin_closing(); });
    thread_.join();
  }

  void listen() {
    Error failed;
    const tcp::endpoint here(asio::ip::address_v4::loopback(), settings_.port);
    acceptor_.open(here.protocol());
    acceptor_.set_option(asio::socket_base::reuse_address(true));
    acceptor_.bind(here, failed);
    if (!failed) acceptor_.listen(asio::socket_base::max_listen_connections, failed);
    if (failed) {
      throw ConfigurationError(
          fmt::format("--live {0}: cannot listen on 127.0.0.1:{0}: {1}; give another port, or none for any free one",
                      settings_.port, failed.message()));
    }
    port_ = acceptor_.local_endpoint().port();
  }

  void run() {
    // Linux gives each thread its own nice value: acquisition comes first.
    ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kYielding);
    io_.run();
  }

  void arm() {
    if (settings_.frame.count() == 0) return;
    frames_due_.expires_after(settings_.frame);
    frames_due_.async_wait([this](Error failed) {
      if (failed || closing_) return;
      frame();
      arm();
    });
  }

  /// False: no word of a page.
  bool obey(const std::string& word) {
    if (word == kStopWord) {
      stop_asked();
      return true;
    }
    const auto* key = std::ranges::find(kSteeringWords, word, &SteeringWord::text);
    if (!settings_.can_steer || key == std::end(kSteeringWords)) return false;
    feed_.press(key->key);
    return true;
  }

  void stop_asked() {
    if (!settings_.can_stop || !feed_.ask_stop()) return;
    broadcast(stop_message(feed_.newest().time_s));
  }

  void begin_closing() {
    frame();
    closing_ = true;
    Error ignored;
    acceptor_.close(ignored);
    frames_due_.cancel();
    closing_limit_.expires_after(kClosingLimit);
    closing_limit_.async_wait([this](Error) { io_.stop(); });
    finish_if_all_sent();
  }

  void accept();
  void frame();
  void broadcast(const Message& message);
  void finish_if_all_sent();

  Settings settings_;
  Feed& feed_;
  std::list<Request*> requests_;  // oldest first; before the context, whose end destroys requests
  asio::io_context io_{1};
  tcp::acceptor acceptor_{io_};
  asio::steady_timer frames_due_{io_}, closing_limit_{io_};
  std::uint16_t port_ = 0;
  History history_;
  std::set<std::shared_ptr<Client>> clients_;
  std::uint64_t last_shown_ = 0;
  Wall::time_point shown_at_ = Wall::now();
  bool closing_ = false;
  std::atomic<std::size_t> clients_now_{0};
  std::thread thread_;
};

/// One page's WebSocket. At most one message is under way; ticks replace each other, other messages wait in order.
class Server::Impl::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(Impl& impl, tcp::socket socket) : impl_(impl), stream_(std::move(socket)) {}

  void open(const http::request<http::empty_body>& request) {
    Error ignored;
    beast::get_lowest_layer(stream_).socket().set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
    beast::get_lowest_layer(stream_).socket().set_option(tcp::no_delay(true), ignored);
    websocket::stream_base::timeout limits{};
    limits.handshake_timeout = impl_.settings_.request_limit;
    limits.idle_timeout = kIdle;
    limits.keep_alive_pings = true;
    stream_.set_option(limits);
    stream_.read_message_max(kLongestWord);
    stream_.text(true);
    stream_.async_accept(request, [self = shared_from_this()](Error failed) { self->opened(failed); });
  }

  void send(const Text& message) {
    if (!open_ || closing_) return;
    waiting_.push_back(message);
    if (waiting_.size() > impl_.settings_.most_waiting) return drop();
    pump();
  }
  void send_tick(Text tick) {
    if (!open_ || closing_) return;
    if (newest_) ++skipped_;
    newest_ = std::move(tick);
    pump();
  }
  void drop_if_slow() {
    if (sending_ && Wall::now() - began_ > impl_.settings_.patience) drop();
  }
  [[nodiscard]] bool all_sent() const { return !sending_ && waiting_.empty() && !newest_; }
  [[nodiscard]] std::uint64_t skipped() const { return skipped_; }
  void close() {
    if (std::exchange(closing_, true)) return;
    if (!open_) return drop();
    stream_.async_close(websocket::close_reason(websocket::close_code::going_away, "over"),
                        [self = shared_from_this()](Error) { self->leave(); });
  }

 private:
  void opened(Error failed) {
    if (failed) return leave();
    open_ = true;
    send(std::make_shared<const std::string>(impl_.settings_.hello));
    send(std::make_shared<const std::string>(impl_.history_.message()));
    read();
  }

  void read() {
    stream_.async_read(read_buffer_, [self = shared_from_this()](Error failed, std::size_t) {
      if (failed) return self->leave();
      const std::string word = beast::buffers_to_string(self->read_buffer_.data());
      self->read_buffer_.clear();
      if (!self->impl_.obey(word)) return self->drop();
      self->read();
    });
  }

  void pump() {
    if (sending_) return;
    if (!waiting_.empty()) {
      under_way_ = std::move(waiting_.front());
      waiting_.pop_front();
    } else if (newest_) {
      under_way_ = std::move(newest_);
      newest_.reset();
    } else {
      return;
    }
    sending_ = true;
    began_ = Wall::now();
    stream_.async_write(asio::buffer(*under_way_), [self = shared_from_this()](Error failed, std::size_t) {
      self->sending_ = false;
      if (failed) return self->leave();
      self->pump();
      if (self->impl_.closing_) self->impl_.finish_if_all_sent();
    });
  }

  void drop() {
    Error ignored;
    beast::get_lowest_layer(stream_).socket().close(ignored);
    leave();
  }

  void leave() {
    open_ = false;
    waiting_.clear();
    newest_.reset();
    impl_.clients_.erase(shared_from_this());
    impl_.clients_now_ = impl_.clients_.size();
    if (impl_.closing_) impl_.finish_if_all_sent();
  }

  Impl& impl_;
  websocket::stream<beast::tcp_stream, false> stream_;
  beast::flat_buffer read_buffer_;
  std::deque<Text> waiting_;
  Text newest_, under_way_;
  Wall::time_point began_;
  std::uint64_t skipped_ = 0;
  bool open_ = false, sending_ = false, closing_ = false;
};

/// One request: answered, or passed on to a Client.
class Server::Impl::Request : public std::enable_shared_from_this<Request> {
 public:
  Request(Impl& impl, tcp::socket socket)
      : impl_(impl), stream_(std::move(socket)), place_(impl.requests_.insert(impl.requests_.end(), this)) {}
  ~Request() { impl_.requests_.erase(place_); }

  /// For a newer one: what is half open does not keep others out.
  void give_way() {
    impl_.requests_.splice(impl_.requests_.end(), impl_.requests_, place_);
    stream_.close();
  }

  void read() {
    parser_.header_limit(kLongestHeader);
    parser_.body_limit(0);
    stream_.expires_after(impl_.settings_.request_limit);
    http::async_read(stream_, buffer_, parser_, [self = shared_from_this()](Error failed, std::size_t) {
      if (failed == http::error::header_limit || failed == http::error::buffer_overflow)
        return self->answer(431, "the request is too long");
      if (failed == http::error::unexpected_body || failed == http::error::body_limit)
        return self->answer(400, "requests must not have a body");
      if (failed == beast::error::timeout || failed == http::error::end_of_stream ||
          failed == asio::error::operation_aborted)
        return;
      if (failed) return self->answer(400, "not an HTTP request");
      self->judge();
    });
  }

 private:
  void judge() {
    const auto& request = parser_.get();
    const auto hosts = request.count(http::field::host), origins = request.count(http::field::origin);
    if (hosts != 1 || origins > 1) return answer(400, "exactly one Host and at most one Origin header");
    AccessRequest asked{view(request.method_string()),
                        view(request.target()),
                        view(request[http::field::host]),
                        {},
                        websocket::is_upgrade(request)};
    if (origins == 1) asked.origin = view(request[http::field::origin]);
    const Answer answer_to = authorize(asked, impl_.settings_.token);
    if (answer_to.to == Access::page) return answer_page();
    if (answer_to.to == Access::denied) return answer(answer_to.status, answer_to.words);
    if (impl_.clients_.size() >= impl_.settings_.most_clients) return answer(503, "too many pages are open");
    stream_.expires_never();
    const auto client = std::make_shared<Client>(impl_, stream_.release_socket());
    impl_.clients_.insert(client);
    impl_.clients_now_ = impl_.clients_.size();
    client->open(request);
  }

  void answer(unsigned status, const std::string& words) {
    begin(status, "text/plain; charset=utf-8");
    answer_.body() = "kphi: " + words + "\n";
    send();
  }

  void answer_page() {
    const std::string nonce = new_token();
    begin(200, "text/html; charset=utf-8");
    const std::string host(view(parser_.get()[http::field::host]));
    answer_.set("Content-Security-Policy",
                fmt::format("default-src 'none'; script-src 'nonce-{0}'; style-src 'nonce-{0}'; "
                            "style-src-attr 'unsafe-inline'; img-src data:; "
                            "connect-src ws://{1}; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
                            nonce, host));
    answer_.body() = boost::algorithm::replace_all_copy(impl_.settings_.page, "@NONCE@", nonce);
    send();
  }

  void begin(unsigned status, const char* type) {
    answer_.result(status);
    answer_.version(11);
    answer_.set(http::field::content_type, type);
    answer_.set(http::field::cache_control, "no-store");
    answer_.set("Referrer-Policy", "no-referrer");
    answer_.set("X-Content-Type-Options", "nosniff");
    answer_.set("X-Frame-Options", "DENY");
    answer_.keep_alive(false);
  }

  void send() {
    answer_.prepare_payload();
    stream_.expires_after(impl_.settings_.request_limit);
    http::async_write(stream_, answer_, [self = shared_from_this()](Error, std::size_t) {
      Error ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
      self->linger();
    });
  }

  /// Reads the rest of the request, since closing before that could discard the answer.
  void linger() {
    stream_.async_read_some(asio::buffer(rest_), [self = shared_from_this()](Error failed, std::size_t n) {
      self->lingered_ += n;
      if (!failed && self->lingered_ < 64 * kLongestHeader) self->linger();
    });
  }

  Impl& impl_;
  beast::tcp_stream stream_;
  std::list<Request*>::iterator place_;
  beast::flat_buffer buffer_{2 * kLongestHeader};
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> answer_;
  std::array<char, 4096> rest_;
  std::size_t lingered_ = 0;
};

void Server::Impl::accept() {
  acceptor_.async_accept([this](Error failed, tcp::socket socket) {
    if (failed == asio::error::operation_aborted) return;
    if (requests_.size() >= kMostRequests) requests_.front()->give_way();
    if (!failed) std::make_shared<Request>(*this, std::move(socket))->read();
    accept();
  });
}

void Server::Impl::frame() {
  feed_.take([this](const Message& message) { broadcast(message); });
  const Tick tick = feed_.newest();
  const std::uint64_t shown = feed_.shown();
  if (shown != last_shown_) shown_at_ = Wall::now();
  if (std::exchange(last_shown_, shown) != shown) history_.keep(tick);
  const double silent_s = std::chrono::duration<double>(Wall::now() - shown_at_).count();
  const auto clients = clients_;  // a dropped client leaves the set
  for (const auto& client : clients) {
    if (shown > 0)
      client->send_tick(
          std::make_shared<const std::string>(tick_message(tick, silent_s, client->skipped() + feed_.dropped())));
    client->drop_if_slow();
  }
}

void Server::Impl::broadcast(const Message& message) {
  history_.keep(message);
  const Text text = std::make_shared<const std::string>(message.text);
  const auto clients = clients_;
  for (const auto& client : clients) client->send(text);
}

void Server::Impl::finish_if_all_sent() {
  for (const auto& client : clients_)
    if (!client->all_sent()) return;
  const auto clients = clients_;
  for (const auto& client : clients) client->close();
  // The closing handshake is optional: do not wait for its answer.
  if (clients.empty()) io_.stop();
}

Server::Server(Settings settings, Feed& feed) : impl_(std::make_unique<Impl>(std::move(settings), feed)) {}
Server::~Server() = default;
std::uint16_t Server::port() const noexcept { return impl_->port_; }
std::string Server::url() const {
  return fmt::format("http://127.0.0.1:{}/?token={}", impl_->port_, impl_->settings_.token);
}
std::size_t Server::clients() const noexcept { return impl_->clients_now_; }
void Server::draw() {
  asio::post(impl_->io_, [impl = impl_.get()] { impl->frame(); });
}

}  // namespace kphi::daq::live
