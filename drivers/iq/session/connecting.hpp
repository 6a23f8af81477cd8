// Queries and settings other than telemetry: from callers, such as an audit, and for every connection.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "drivers/iq/exchange/exchange.hpp"
#include "drivers/iq/wire/identity.hpp"

namespace kphi::iq {

struct Inquiry {
  const Entry* entry = nullptr;
  std::optional<double> set_to;  ///< set first, then read back
};

struct Reply {
  std::optional<double> value;  ///< in the entry's own unit; nullopt: no answer
  bool accepted = false;        ///< the module reads back what was set, bit by bit
  Instant time{0};              ///< bench time at which the module read the value
  Duration uncertainty{0};      ///< the true moment is time ± uncertainty
};

/// Asks a module that does not turn for it: one reply each, in order. Throws DeviceError when the module is lost.
using Ask = std::function<std::vector<Reply>(std::vector<Inquiry>)>;

/// One inquiry under way: when to ask again, and when it is finished.
class OpenInquiry {
 public:
  static constexpr int kAttempts = 3;

  explicit OpenInquiry(const Inquiry& inquiry, int attempts = kAttempts) noexcept
      : inquiry_(inquiry), attempts_(attempts) {}

  [[nodiscard]] const Inquiry& inquiry() const noexcept { return inquiry_; }
  /// Sends the next attempt when there is room for it.
  void advance(Exchange& exchange, int module_id, Instant now);
  /// Whether the result is that of the attempt under way.
  bool take(const QueryResult& result) noexcept;
  /// The result of one attempt; nullopt: no usable answer.
  void take(std::optional<double> answer) noexcept;
  void give_up() noexcept {
    attempts_ = 0;
    asked_ = false;
  }
  /// Answered, accepted or given up: no further attempt.
  [[nodiscard]] bool done() const noexcept { return attempts_ <= 0; }
  [[nodiscard]] const Reply& reply() const noexcept { return reply_; }

 private:
  Inquiry inquiry_;
  int attempts_;
  bool asked_ = false;  ///< waiting for the answer
  Reply reply_;
};

/// Queries of callers, sent between the polls, and settings that are read back bit by bit.
class Inquiries {
 public:
  explicit Inquiries(int module_id) noexcept : module_id_(module_id) {}

  /// Throws std::invalid_argument for an entry that is not readable as a number, or must not be set in passing.
  static void check(const std::vector<Inquiry>& inquiries);
  /// Starts over with these, which are checked.
  void begin(const std::vector<Inquiry>& inquiries) { open_ = {inquiries.begin(), inquiries.end()}; }
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
  int module_id_;
  std::vector<OpenInquiry> open_;
};

/// What is asked and set at connection, one question at a time.
class Connecting {
 public:
  /// `settings` are completed.
  explicit Connecting(const Settings& settings);

  /// Starts from the first step. `known`: the only module that is accepted.
  void begin(const std::optional<AuditRecord>& known);
  /// Done without a step.
  void skip() noexcept;
  void take(const QueryResult& result);
  /// Sends the next query when there is room for it.
  void advance(Exchange& exchange, Instant now);

  [[nodiscard]] bool done() const noexcept;
  /// Why it failed; empty if it has not.
  [[nodiscard]] const std::string& failure() const noexcept { return failure_; }
  /// The failure is that another module answers.
  [[nodiscard]] bool another_module() const noexcept { return another_module_; }
  /// Complete once done.
  [[nodiscard]] const AuditRecord& identity() const noexcept { return identity_; }
  /// The id at which system_control answers: the module's; with old firmware always 0.
  [[nodiscard]] int system_control_id() const noexcept { return system_control_id_; }

 private:
  [[nodiscard]] std::optional<double> wanted() const noexcept;
  [[nodiscard]] OpenInquiry inquiry() const noexcept;
  void conclude(const char* why_silent);
  void take_silence(const char* why);
  void take_own_id(double id);
  void compare_uid();
  void next() noexcept;

  int module_id_;
  double module_timeout_s_;
  std::optional<AuditRecord> known_;
  AuditRecord identity_;
  int system_control_id_;
  std::size_t step_ = 0;
  std::optional<OpenInquiry> open_;  ///< of this step
  std::string failure_;
  bool another_module_ = false;
};

}  // namespace kphi::iq
