// A supply behind Modbus, RTU or TCP. Blocking, one thread.
//
// No stale values. After any failure the line is left to fall silent and flushed, and then the device is asked for its
// identity: answers come in the order of requests, and no other answer has this length, so once it has arrived no older
// answer can follow. The same request detects that another device has been plugged in.
#pragma once

#include <functional>
#include <string>

#include "drivers/supply/modbus_link.hpp"
#include "drivers/supply/supply.hpp"
#include "drivers/supply/wire.hpp"

namespace kphi::supply {

class ModbusSupply final : public Supply {
 public:
  /// Opens, identifies the device, and reads once; writes nothing. Throws DeviceError: no such port or host, in use, no
  /// answer, unknown model, or not the model of the address. `clock` outlives the supply and stamps readings only;
  /// deadlines are wall time.
  ModbusSupply(const Address& address, const Clock& clock, const Timing& timing = {});

  [[nodiscard]] const Identity& identity() const noexcept override { return identity_; }
  Limits apply(const Limits& limits) override;
  using Supply::read;
  [[nodiscard]] SupplyReading read(const std::function<void()>& between) override;
  /// Sends the command at least once, even if the device does not answer.
  void switch_off() override;

 private:
  /// Throws DeviceError unless limits have been applied before.
  void switch_on() override;

  void identify();
  [[nodiscard]] const Model* ask_model(const RegisterMap& map, std::string& answers);
  void describe();
  [[nodiscard]] Outcome look(SupplyReading& reading, const std::function<void()>& between);
  [[nodiscard]] std::string implausible(SupplyReading& reading) const;
  [[nodiscard]] const CurrentRange& range() const noexcept;

  // Bounded retries around single requests.
  void persist(const std::string& operation, const std::function<Outcome()>& attempt);
  [[nodiscard]] Outcome settle();
  [[nodiscard]] std::string remedy(Failure failure) const;

  const Address address_;
  const Clock& clock_;
  ModbusLink link_;
  const Model* model_ = nullptr;
  RegisterImage registers_{};
  RegisterImage known_{};  ///< at identification
  Identity identity_;
  bool unsettled_ = true;  ///< old answers may still arrive
  bool limits_applied_ = false;
};

}  // namespace kphi::supply
