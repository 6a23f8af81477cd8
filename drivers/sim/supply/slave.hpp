// A simulated bench supply behind Modbus: requests in, replies out, with the faults of a script. Frames follow Modbus
// over serial line 1.02 (RTU) and Modbus messaging on TCP/IP 1.0b, independently of the library that the driver uses.
// Virtual time, seeded, no I/O: the same inputs at the same times give the same bytes.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.hpp"
#include "drivers/sim/script/faults.hpp"
#include "drivers/sim/script/script_run.hpp"
#include "drivers/sim/supply/circuit.hpp"
#include "drivers/sim/supply/registers.hpp"

namespace kphi::sim {

enum class ModbusFraming : std::uint8_t { rtu, tcp };

/// CRC-16/MODBUS: reflected 0xA001, begins with 0xFFFF; its low byte travels first.
[[nodiscard]] std::uint16_t modbus_crc(std::span<const std::uint8_t> bytes) noexcept;

struct ModbusRequest {
  int unit = 0;                   ///< slave address; 0: everybody
  std::uint16_t transaction = 0;  ///< TCP only
  std::vector<std::uint8_t> pdu;  ///< function code first; never empty
  std::vector<std::uint8_t> adu;  ///< the whole frame as it came
};

[[nodiscard]] std::vector<std::uint8_t> modbus_frame(ModbusFraming framing, int unit, std::uint16_t transaction,
                                                     std::span<const std::uint8_t> pdu);

class ModbusScanner {
 public:
  explicit ModbusScanner(ModbusFraming framing) noexcept : framing_(framing) {}
  /// RTU: 50 ms of silence end a frame, whole or not.
  void feed(std::span<const std::uint8_t> bytes, Instant now);
  [[nodiscard]] std::optional<ModbusRequest> next();
  /// TCP: the stream is broken; close it.
  [[nodiscard]] bool broken() const noexcept { return broken_; }

 private:
  [[nodiscard]] std::optional<ModbusRequest> next_rtu();
  [[nodiscard]] std::optional<ModbusRequest> next_tcp();
  ModbusRequest take(std::size_t length, std::size_t header, std::size_t trailer, unsigned transaction);

  ModbusFraming framing_;
  std::vector<std::uint8_t> waiting_;
  Instant last_{0};
  bool broken_ = false;
};

struct SupplySettings {
  std::string model = "RD6006";
  std::uint32_t serial = 4711;
  int slave = 1;
  double replies_per_s = 10;  ///< stock Riden firmware; about 65 with another; 0: as fast as asked
  Duration turnaround = std::chrono::milliseconds(1);
  SupplyParameters circuit;
  bool over_current_in_milliamps = false;  ///< Hanmatek 0x21: three decimals, else two; sources disagree
  FaultScript faults;
  std::uint64_t seed = 1;  ///< of the faults' probabilities
};

/// Bytes on their way to a client.
struct SupplyReply {
  int client = 0;
  std::vector<std::uint8_t> bytes;
};

/// Requests and writes that the slave received.
struct SupplyTruth {
  std::uint64_t requests = 0;                                   ///< whole, and for this slave
  std::uint64_t faults = 0;                                     ///< times that a fault met a reply
  std::vector<std::pair<std::uint16_t, std::uint16_t>> writes;  ///< register and value, in order
  std::vector<std::vector<std::uint8_t>> frames;                ///< requests as they came; the first 1000
  std::uint64_t dead_keys = 0;                                  ///< times that a locked key was pressed
};

class SupplySlave {
 public:
  /// Throws std::invalid_argument for an unknown model.
  explicit SupplySlave(const SupplySettings& settings);
  SupplySlave(const SupplySlave&) = delete;
  SupplySlave& operator=(const SupplySlave&) = delete;

  /// Physics up to `now` with this load, in one step of at most a second; returns the voltage at the terminals.
  double advance(const SupplyLoad& load, Instant now);
  /// Bytes of a client, one stream each; `framing` is the client's for good.
  void receive(int client, ModbusFraming framing, std::span<const std::uint8_t> bytes, Instant now);
  /// The next reply that has left until `now`.
  [[nodiscard]] bool next_reply(SupplyReply& out, Instant now);
  /// When the next reply leaves; kNever.
  [[nodiscard]] Instant next_due() const noexcept { return under_way_.empty() ? kNever : under_way_.front().due; }
  /// A client has gone: drops its pending replies.
  void forget(int client);
  /// False: its stream is broken; close it.
  [[nodiscard]] bool makes_sense(int client) const;
  /// The fault `closed` is active.
  [[nodiscard]] bool closed(Instant now) const noexcept;
  // For joining a client without frames and a wire.
  /// A command sent now reaches it.
  [[nodiscard]] bool hears(Instant now);
  /// Delay of the whole answer to a request sent now; nullopt: no answer.
  [[nodiscard]] std::optional<Duration> answers(Instant now);
  /// One more fault, from now on.
  void add_fault(const Fault& fault) { script_.add(fault); }

  [[nodiscard]] SupplyCircuit& circuit() noexcept { return circuit_; }
  [[nodiscard]] SupplyRegisters& registers() noexcept { return registers_; }
  [[nodiscard]] const SupplyTruth& truth() const noexcept { return truth_; }

 private:
  struct PendingReply {
    Instant due;
    SupplyReply reply;
  };
  using Pdu = std::vector<std::uint8_t>;

  void answer(int client, ModbusFraming framing, const ModbusRequest& request, Instant now);
  [[nodiscard]] Pdu apply(const Pdu& pdu, Instant now);
  [[nodiscard]] Pdu read(const Pdu& pdu, Instant now);
  [[nodiscard]] Pdu write(const Pdu& pdu, Instant now);
  [[nodiscard]] std::uint16_t value_at(std::uint16_t at, std::uint16_t value, Instant now) const;
  /// A Riden's own firmware locks it while it is asked.
  [[nodiscard]] bool keypad_locked(Instant now) const;
  void press_output_key(Instant now);
  void send(int client, std::vector<std::uint8_t> bytes, Instant due, Duration gap);
  /// The first active fault of this kind that meets this reply; nullptr.
  [[nodiscard]] const Fault* meet(FaultKind kind, Instant now);

  SupplySettings settings_;
  SupplyCircuit circuit_;
  SupplyRegisters registers_;
  ScriptRun script_;
  std::map<int, ModbusScanner> scanners_;
  std::deque<PendingReply> under_way_;
  Instant reached_{0}, last_due_{0}, next_turn_{0};
  std::optional<Instant> last_asked_;
  SupplyTruth truth_;
};

}  // namespace kphi::sim
