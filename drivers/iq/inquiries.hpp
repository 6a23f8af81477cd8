// Questions of others, such as an audit, asked between the polls; and settings that are read back bit by bit.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "drivers/iq/exchange.hpp"

namespace kphi::iq {

struct Inquiry {
  const Entry* entry = nullptr;
  std::optional<double> set_to;  ///< set first, then read back
};

struct Reply {
  std::optional<double> value;  ///< in the entry's own unit; nothing: no answer
  bool accepted = false;        ///< the module reads back what was set, bit by bit
};

class Inquiries {
 public:
  explicit Inquiries(int module_id) noexcept : module_id_(module_id) {}

  /// Throws std::invalid_argument for what may not be read, or not be set in passing.
  static void check(const std::vector<Inquiry>& inquiries);
  /// Begins anew with these, which are checked.
  void begin(std::vector<Inquiry> inquiries);
  void take(const Heard& heard);
  void advance(Exchange& exchange, int system_control_id, Instant now);
  /// Gives the open ones up: the link is gone.
  void abandon() noexcept;
  [[nodiscard]] bool done() const noexcept { return left_ == 0; }
  /// This one is being set.
  [[nodiscard]] bool sets(const Entry& entry) const noexcept;
  /// One for each, in order.
  [[nodiscard]] const std::vector<Reply>& replies() const noexcept { return replies_; }

 private:
  enum class State { waiting, asked, done };
  void finish(std::size_t i) noexcept;

  int module_id_;
  std::vector<Inquiry> inquiries_;
  std::vector<State> states_;
  std::vector<int> attempts_;
  std::vector<Reply> replies_;
  std::size_t left_ = 0;
};

}  // namespace kphi::iq
