// One question to the module, or one setting and the proof that it arrived, bit by bit: when it is put again, and when
// it is over. Who carries it, and how long an answer may take, is the business of others.
#pragma once

#include <optional>

#include "drivers/iq/entries.hpp"

namespace kphi::iq {

struct Inquiry {
  const Entry* entry = nullptr;
  std::optional<double> set_to;  ///< set first, then read back
};

struct Reply {
  std::optional<double> value;  ///< in the entry's own unit; nothing: no answer
  bool accepted = false;        ///< the module reads back what was set, bit by bit
};

class OpenInquiry {
 public:
  static constexpr int kAttempts = 3;

  explicit OpenInquiry(const Inquiry& inquiry, int attempts = kAttempts) noexcept
      : inquiry_(inquiry), attempts_(attempts) {}

  [[nodiscard]] const Inquiry& inquiry() const noexcept { return inquiry_; }
  /// What an attempt brought; nothing: no answer that can be used.
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

}  // namespace kphi::iq
