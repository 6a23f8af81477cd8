// The motor module on a serial port: one session, pumped by a thread of its own.
//
// Safety. The motor coasts: when asked, from any thread; when nobody has called spin_at or renew for 0.5 s of wall
// time although polling goes on; when the module or the port fails; when the module has restarted by itself; when the
// thread ends for whatever reason; and when the object is destroyed. If this process is killed, the module's own
// communication timeout coasts it.
//
// After a failure the link looks for the port and the module by itself and coasts what it finds. The motor spins again
// only when its owner has seen the failure and calls rearm().
#pragma once

#include <memory>
#include <string>

#include "drivers/iq/link/module_handle.hpp"

namespace kphi::iq {

class Motor final : public ModuleHandle {
 public:
  /// Opens the port exclusively and connects (coasting first); blocks for at most 10 s, usually some 50 ms. Deadlines
  /// of the protocol are wall time: `settings.reply_timeout` 0 becomes clock.stretched(100 ms), wire_byte_time 0
  /// becomes 10/baud. module_timeout_s goes to the module as it is, in the module's own seconds. Throws DeviceError:
  /// port missing, forbidden or in use, no module answers, the module refused its communication timeout. Prefer a
  /// `device` name that stays (/dev/serial/by-id/…): it is opened again after the port was lost. `clock` must outlive
  /// the motor. `capture`: file for all bytes of the line (capture.hpp); empty: no capture.
  Motor(const std::string& device, unsigned baud, const Settings& settings, const Clock& clock,
        const std::string& capture = {});
  /// Coasts three times, waits at most 0.6 s for drive mode coast, closes.
  ~Motor();

 private:
  std::unique_ptr<Link> link_;
};

}  // namespace kphi::iq
