// Several modules on one line, each with a session of its own; one is the usual case. All hear the host, and their
// replies share a wire: so one of them at a time has the line until its last question is answered. Coasts never wait.
// A module that does not confirm its coast falls back on its own communication timeout, which the others' traffic might
// keep from firing: then they all coast and fall silent. No port, thread or clock. One thread.
#pragma once

#include <span>
#include <vector>

#include "drivers/iq/session.hpp"

namespace kphi::iq {

class Bus {
 public:
  /// At least one, each with an id of its own; else std::invalid_argument.
  explicit Bus(const std::vector<Settings>& modules);

  [[nodiscard]] std::size_t size() const noexcept { return sessions_.size(); }
  [[nodiscard]] Session& module(std::size_t i) noexcept { return sessions_[i]; }
  [[nodiscard]] const Session& module(std::size_t i) const noexcept { return sessions_[i]; }

  /// The line is another one now: all connect.
  void connect_anew(Instant now);
  /// The line is gone.
  void lose(const std::string& why, Instant now);
  /// Broadcast, and three times by each id.
  void emergency_stop(Instant now);

  void receive(std::span<const std::uint8_t> bytes, Instant now);
  void advance(Instant now);
  [[nodiscard]] std::span<const std::uint8_t> output();
  void sent(std::size_t n) noexcept;
  [[nodiscard]] Instant deadline() const noexcept;

 private:
  void settle(Instant now);
  void stop_for_the_silent(Instant now);
  void pass_the_line(Instant now);
  void collect();

  std::vector<Session> sessions_;
  std::size_t speaker_ = 0;  ///< who has the line
  std::vector<std::uint8_t> output_;
};

}  // namespace kphi::iq
