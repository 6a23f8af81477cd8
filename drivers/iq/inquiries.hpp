// Questions of others, such as an audit, asked between the polls; and settings that are read back bit by bit.
#pragma once

#include <vector>

#include "drivers/iq/exchange.hpp"
#include "drivers/iq/inquiry.hpp"

namespace kphi::iq {

class Inquiries {
 public:
  explicit Inquiries(int module_id) noexcept : module_id_(module_id) {}

  /// Throws std::invalid_argument for what may not be read, or not be set in passing.
  static void check(const std::vector<Inquiry>& inquiries);
  /// Begins anew with these, which are checked.
  void begin(const std::vector<Inquiry>& inquiries);
  void take(const Heard& heard);
  void advance(Exchange& exchange, int system_control_id, Instant now);
  /// Gives the open ones up: the link is gone.
  void abandon() noexcept;
  [[nodiscard]] bool done() const noexcept;
  /// This one is being set.
  [[nodiscard]] bool sets(const Entry& entry) const noexcept;
  /// One for each, in order.
  [[nodiscard]] std::vector<Reply> replies() const;

 private:
  struct Item {
    OpenInquiry open;
    bool asked = false;  ///< an answer is awaited
  };

  int module_id_;
  std::vector<Item> items_;
};

}  // namespace kphi::iq
