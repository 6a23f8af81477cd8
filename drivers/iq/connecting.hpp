// The way through the script of a connection, one question at a time.
#pragma once

#include <optional>
#include <string>

#include "drivers/iq/exchange.hpp"
#include "drivers/iq/inquiry.hpp"
#include "drivers/iq/script.hpp"

namespace kphi::iq {

class Connecting {
 public:
  /// `settings` are completed.
  explicit Connecting(const Settings& settings);

  /// From the beginning. `known`: the only module that will do.
  void begin(const std::optional<Identity>& known);
  void take(const Heard& heard);
  /// Asks the next question when there is room for it.
  void advance(Exchange& exchange, Instant now);

  [[nodiscard]] bool done() const noexcept { return step_ == std::size(kScript); }
  /// Why it cannot go on; empty else.
  [[nodiscard]] const std::string& failure() const noexcept { return failure_; }
  /// The failure is that another module answers.
  [[nodiscard]] bool another_module() const noexcept { return another_module_; }
  /// Whole once done.
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
  bool asked_ = false;               ///< an answer is awaited
  std::string failure_;
  bool another_module_ = false;
};

}  // namespace kphi::iq
