// What is asked and set at connection, one question at a time.
#pragma once

#include <optional>
#include <string>

#include "drivers/iq/exchange/exchange.hpp"
#include "drivers/iq/session/inquiries.hpp"
#include "drivers/iq/wire/identity.hpp"

namespace kphi::iq {

class Connecting {
 public:
  /// `settings` are completed.
  explicit Connecting(const Settings& settings);

  /// Starts from the first step. `known`: the only module that is accepted.
  void begin(const std::optional<Identity>& known);
  void take(const QueryResult& result);
  /// Sends the next query when there is room for it.
  void advance(Exchange& exchange, Instant now);

  [[nodiscard]] bool done() const noexcept;
  /// Why it failed; empty if it has not.
  [[nodiscard]] const std::string& failure() const noexcept { return failure_; }
  /// The failure is that another module answers.
  [[nodiscard]] bool another_module() const noexcept { return another_module_; }
  /// Complete once done.
  [[nodiscard]] const Identity& identity() const noexcept { return identity_; }

 private:
  [[nodiscard]] int id_of(const Entry& entry) const noexcept;
  [[nodiscard]] std::optional<double> wanted() const noexcept;
  [[nodiscard]] OpenInquiry inquiry() const noexcept;
  void conclude(const char* why_silent);
  void take_silence(const char* why);
  void take_own_id(double id);
  void compare_uid();
  void next() noexcept;

  int module_id_;
  double module_timeout_s_;
  std::optional<Identity> known_;
  Identity identity_;
  std::size_t step_ = 0;
  std::optional<OpenInquiry> open_;  ///< of this step
  bool asked_ = false;               ///< waiting for the answer
  std::string failure_;
  bool another_module_ = false;
};

}  // namespace kphi::iq
