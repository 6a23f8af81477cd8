// Queries by callers, such as an audit, sent between the polls, and settings that are read back bit by bit.
#pragma once

#include <optional>
#include <vector>

#include "drivers/iq/exchange/exchange.hpp"

namespace kphi::iq {

struct Inquiry {
  const Entry* entry = nullptr;
  std::optional<double> set_to;  ///< set first, then read back
};

struct Reply {
  std::optional<double> value;  ///< in the entry's own unit; nullopt: no answer
  bool accepted = false;        ///< the module reads back what was set, bit by bit
};

/// One of them under way: when it is asked again, and when it is finished. Somebody else carries it and decides how
/// long an answer may take.
class OpenInquiry {
 public:
  static constexpr int kAttempts = 3;

  explicit OpenInquiry(const Inquiry& inquiry, int attempts = kAttempts) noexcept
      : inquiry_(inquiry), attempts_(attempts) {}

  [[nodiscard]] const Inquiry& inquiry() const noexcept { return inquiry_; }
  /// The result of one attempt; nullopt: no usable answer.
  void take(std::optional<double> answer) noexcept {
    --attempts_;
    if (!answer) return;
    reply_.value = answer;
    reply_.accepted = inquiry_.set_to && is_as_set(*inquiry_.entry, *inquiry_.set_to, *answer);
    if (!inquiry_.set_to || reply_.accepted) attempts_ = 0;
  }
  void give_up() noexcept { attempts_ = 0; }
  /// Answered, accepted or given up: no further attempt.
  [[nodiscard]] bool done() const noexcept { return attempts_ <= 0; }
  [[nodiscard]] const Reply& reply() const noexcept { return reply_; }

 private:
  Inquiry inquiry_;
  int attempts_;
  Reply reply_;
};

class Inquiries {
 public:
  explicit Inquiries(int module_id) noexcept : module_id_(module_id) {}

  /// Throws std::invalid_argument for an entry that is not readable as a number, or must not be set in passing.
  static void check(const std::vector<Inquiry>& inquiries);
  /// Starts over with these, which are checked.
  void begin(const std::vector<Inquiry>& inquiries);
  void take(const QueryResult& result);
  void advance(Exchange& exchange, int system_control_id, Instant now);
  /// Gives up the open ones: the link is lost.
  void abandon() noexcept;
  [[nodiscard]] bool done() const noexcept;
  /// This entry is being set.
  [[nodiscard]] bool sets(const Entry& entry) const noexcept;
  /// One for each, in order.
  [[nodiscard]] std::vector<Reply> replies() const;

 private:
  struct Item {
    OpenInquiry open;
    bool asked = false;  ///< waiting for the answer
  };

  int module_id_;
  std::vector<Item> items_;
};

}  // namespace kphi::iq
