// A supply that speaks SCPI.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "base/clock.hpp"
#include "drivers/scpi/line.hpp"
#include "drivers/supply/supply.hpp"

namespace kphi::scpi {

class ScpiSupply final : public supply::Supply {
 public:
  /// Queries its identity and maxima (*IDN?, VOLT? MAX, CURR? MAX); writes nothing. `clock` must outlive this. Throws
  /// DeviceError.
  ScpiSupply(std::unique_ptr<Line> line, const Clock& clock);

  [[nodiscard]] const supply::Identity& identity() const noexcept override { return identity_; }
  /// After each command the instrument's error queue is asked (SYST:ERR?).
  supply::Limits apply(const supply::Limits& limits) override;
  using Supply::read;
  [[nodiscard]] SupplyReading read(const std::function<void()>& between) override;
  void switch_off() override { switch_output(false); }

 private:
  struct Dialect;
  [[nodiscard]] static const Dialect& dialect_of(std::string_view identity) noexcept;
  void switch_on() override { switch_output(true); }
  void switch_output(bool on);
  [[nodiscard]] std::string next_error();
  void forget_errors();
  void tell(const std::string& command);
  void set(std::string_view command, double value);
  [[nodiscard]] double ask(std::string_view command);
  [[nodiscard]] double ask_within(std::string_view command, double most);
  [[nodiscard]] std::string_view known(std::string_view query);
  [[nodiscard]] bool tripped(std::string_view command);
  [[nodiscard]] SupplyRegulation regulation();
  [[noreturn]] void fail(std::string_view operation, const std::string& cause, const char* next_move = "");

  const std::unique_ptr<Line> line_;
  const Clock& clock_;
  supply::Identity identity_;
  const Dialect* dialect_ = nullptr;
  /// Queries of the dialect that many instruments lack; empty: this one does.
  std::string_view over_voltage_tripped_, over_current_tripped_, regulation_;
};

}  // namespace kphi::scpi
