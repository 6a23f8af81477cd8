// The simulated bench on real transports: UDP, HTTP and TCP for the load cell's box, a pseudo-terminal for the
// motor, a Unix-domain socket for mounting propellers. One thread; poll() wakes it at once for motor and datagrams,
// and every millisecond for all else.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "base/descriptor.hpp"
#include "drivers/sim/simulated_bench.hpp"
#include "drivers/sim/supply/port.hpp"
#include "drivers/sim/transport/conversations.hpp"
#include "drivers/sim/transport/pty.hpp"
#include "drivers/sim/truth_log.hpp"

namespace kphi::sim {

/// Where its devices can be reached.
struct Addresses {
  std::string host = "127.0.0.1";         ///< IPv4 name or address of the box
  std::uint16_t rdt_port = 0;             ///< 0: any free one
  std::uint16_t http_port = 0;            ///< 0: any free one
  std::uint16_t tcp_port = 0;             ///< 0: any free one; 49151 on a real box
  std::string device;                     ///< symlink to the motor's pseudo-terminal; empty: its own /dev/pts name only
  std::optional<SupplyAddresses> supply;  ///< of bench.supply
  std::string control;                    ///< path of the control socket; see control_path
};

struct ServerSettings : Addresses {
  BenchSettings bench;  ///< time_scale there is also the scale of the clock
};

/// What the transports did not accept.
struct Unsent {
  std::uint64_t datagrams = 0;    ///< socket buffer full
  std::uint64_t motor_bytes = 0;  ///< the serial line is not read
};

class Server {
 public:
  /// Opens everything. Throws DeviceError, also if another simulator has the control socket.
  explicit Server(const ServerSettings& settings);
  ~Server();  ///< removes control socket and symlink

  /// The actual ports and names.
  [[nodiscard]] const Addresses& addresses() const noexcept { return addresses_; }
  /// Runs the bench until request_stop(). After a stall it catches up at most eight times as fast as time passes.
  void run();
  /// Thread-safe and signal-safe.
  void request_stop() noexcept { stop_.raise(); }
  /// What the fault script did; after run().
  [[nodiscard]] const WireTruth& truth() noexcept { return bench_.wire().truth(); }
  [[nodiscard]] const IqTruth& motor_truth() noexcept { return bench_.motor_line().truth(); }
  /// Kept when the motor's replies are, too.
  [[nodiscard]] const MotionLog& motion() const noexcept { return motion_; }
  /// After run().
  [[nodiscard]] const Unsent& unsent() const noexcept { return unsent_; }

 private:
  /// `woken`: the first step after a wait; `requested`: the Net Box has been asked something.
  void step(const Clock& clock, bool woken, bool requested);
  void hear_requests();
  void hear_motor(Instant now);
  void log_motion(Instant now);
  void send_datagrams();
  void open_or_close_web();
  void follow_the_address();
  [[nodiscard]] StreamReply in_wall_time(StreamReply reply) const;
  void send_motor();

  double time_scale_;
  Addresses addresses_;
  SimulatedBench bench_;
  const bool keep_motion_;
  MotionLog motion_;
  Wakeup stop_;
  Listening rdt_;
  Listening foreign_;  ///< sends datagrams that a script makes come from another address
  Listening web_;
  Listening coarse_;
  Pty pty_;
  std::optional<SupplyPort> supply_;
  Conversations http_;
  Conversations tcp_;
  Conversations control_;
  Datagram datagram_;  ///< being sent
  Unsent unsent_;
  std::string present_host_;  ///< empty: the box has an address that this computer does not have
  std::string last_wanted_;
  Instant reached_{0};  ///< bench time
};

}  // namespace kphi::sim
