// Asking a module that may not be fit to spin: the dialogue that audits and checks are written against, and the one
// that a serial port carries.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/finding.hpp"
#include "drivers/iq/session/session.hpp"
#include "drivers/serial/port.hpp"

namespace kphi::iq {

/// One module, asked entry by entry: all that audits and checks need of a link. Cannot command motion.
class Dialogue {
 public:
  virtual ~Dialogue() = default;
  /// No value: no answer after the dialogue's retries, so this firmware does not know the entry. What is set lasts
  /// until the next reboot. Throws DeviceError when the line is gone, std::invalid_argument as Inquiries::check.
  virtual Reply inquire(const Inquiry& inquiry) = 0;
  /// Returns after this much bench time.
  virtual void pause(Duration bench) = 0;
};

/// A parameter of the firmware that is set for this connection only, and read back.
struct Setting {
  const Entry* entry = nullptr;
  double value = 0;
  bool required = true;  ///< false: firmware that does not know the entry is accepted
};

/// Sets each and reads it back; saves nothing. A finding for each that is not as set: a fault.
[[nodiscard]] std::vector<Finding> set_and_read_back(Dialogue& module, std::span<const Setting> settings);

/// What every connection sets: the communication timeout, coast at its end, and no song.
[[nodiscard]] std::vector<Setting> connection_settings(double module_timeout_s);

struct SerialLine {
  std::string device;  ///< as serial::Port takes it
  unsigned baud = 115200;
  int module_id = 0;  ///< 0..62
};

/// A session on a serial port that inspects only, one question at a time, without a thread: not for measuring. The
/// motor coasts from the beginning to the end, confirmed.
class SerialDialogue final : public Dialogue {
 public:
  /// Opens the port exclusively, coasts, and asks until the module reports drive mode coast. Throws DeviceError: port
  /// missing or in use, no module answers, or it does not coast. `clock` must outlive the dialogue.
  SerialDialogue(const SerialLine& port, const Clock& clock);
  /// Coasts.
  ~SerialDialogue() override;
  SerialDialogue(const SerialDialogue&) = delete;
  SerialDialogue& operator=(const SerialDialogue&) = delete;

  Reply inquire(const Inquiry& inquiry) override;
  void pause(Duration bench) override;

  /// The path that was opened.
  [[nodiscard]] const std::string& device() const noexcept { return line_.device(); }
  [[nodiscard]] const Counters& counters() const noexcept { return session_.counters(); }
  /// Median from question to reply, without their time on the wire; wall time. Zero before the first.
  [[nodiscard]] Duration median_round_trip() const;
  /// Round trip and line, judged: slow answers, noise.
  [[nodiscard]] std::vector<Finding> findings() const;

 private:
  /// Carries bytes both ways until `done()`.
  template <class Done>
  void pump(Done&& done);

  const SerialLine port_;
  const Clock& clock_;
  serial::Port line_;
  Session session_;
};

}  // namespace kphi::iq
