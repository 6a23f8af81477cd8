// One page on 127.0.0.1 and its WebSocket, in a thread of low priority. It may drop frames, and clients; the runner
// never waits for it.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "daq/live/feed.hpp"

namespace kphi::daq::live {

[[nodiscard]] std::string page_text();

class Server {
 public:
  struct Settings {
    std::uint16_t port = 0;               ///< 0: any that is free
    std::string token;                    ///< required in every request
    std::string page;                     ///< HTML; every "@NONCE@" in it becomes the nonce of its scripts and styles
    std::string hello;                    ///< hello_message
    bool can_stop = true;                 ///< false: "stop" is ignored
    bool can_steer = false;               ///< "up", "down" and "hold" are keys
    std::chrono::milliseconds frame{33};  ///< between ticks; 0: only draw() sends one
    std::chrono::milliseconds patience{2000};       ///< with a client that does not read
    std::chrono::milliseconds request_limit{5000};  ///< for a whole request
    std::size_t most_clients = 16;                  ///< WebSockets
    std::size_t most_waiting = 1024;                ///< messages except ticks, per client
  };
  static constexpr std::size_t kLongestWord = 64;      ///< message from a page, bytes
  static constexpr std::size_t kLongestHeader = 8192;  ///< header of a request, bytes
  static constexpr std::size_t kMostRequests = 64;     ///< under way at once; one more closes the oldest

  /// Listens at once. Throws ConfigurationError if the port is taken. `feed` must outlive this.
  Server(Settings settings, Feed& feed);
  /// Sends waiting messages for at most half a second, and closes.
  ~Server();

  [[nodiscard]] std::uint16_t port() const noexcept;
  /// With the token.
  [[nodiscard]] std::string url() const;
  /// WebSockets that are open now. Any thread.
  [[nodiscard]] std::size_t clients() const noexcept;
  /// Sends messages and one tick soon; returns at once. Thread-safe.
  void draw();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kphi::daq::live
