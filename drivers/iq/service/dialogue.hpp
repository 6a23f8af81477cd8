// Asking a module without a session: the dialogue that audits and checks are written against, and the one that a serial
// port carries.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/finding.hpp"
#include "drivers/iq/exchange/telemetry.hpp"
#include "drivers/iq/wire/entries.hpp"
#include "drivers/serial/port.hpp"

namespace kphi::iq {

struct Answer {
  double value = 0;         ///< in the entry's unit
  Instant time{0};          ///< bench time: the middle of the span in which the module read the value
  Duration uncertainty{0};  ///< half of that span: from the end of the question to the beginning of the reply
};

/// One module, asked entry by entry: all that audits and checks need of a link. Cannot command motion.
class Dialogue {
 public:
  virtual ~Dialogue() = default;
  /// nullopt: no answer after the dialogue's retries, so this firmware does not know the entry. Throws DeviceError when
  /// the line is gone.
  virtual std::optional<Answer> ask(const Entry& entry) = 0;
  /// Sets until the next reboot; never answered. Throws std::logic_error unless is_volatile_setting.
  void tell(const Entry& entry, double value);
  /// Returns after this much bench time.
  virtual void pause(Duration bench) = 0;

 private:
  virtual void send(const Entry& entry, double value) = 0;
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

/// A reply of this module to a query of this entry, whatever its data.
[[nodiscard]] bool is_reply_of(const Packet& packet, const Entry& asked, int module_id) noexcept;

/// A serial line used by hand, blocking: for work without a session, such as an audit or a search. Wall time. One
/// thread.
class Conversation {
 public:
  /// Opens the port; throws DeviceError.
  Conversation(const std::string& device, unsigned baud) : port_(device, baud) {}

  [[nodiscard]] const std::string& device() const noexcept { return port_.device(); }
  [[nodiscard]] unsigned baud() const noexcept { return port_.baud(); }
  /// Of this host's port only. Waits until all has left; then both directions are emptied, and the module's parser too,
  /// which may wait for the end of a false frame.
  void set_baud(unsigned baud);
  /// False: the line did not take all of it. Throws serial::PortGone.
  bool tell(const Packet& packet);
  /// The number answered; nullopt: no answer within `wall` of the last byte sent. Other replies are discarded.
  [[nodiscard]] std::optional<double> ask(const Entry& entry, int module_id, Duration wall);
  /// All packets that come within `wall`, to `sink(const Packet&)`, until it returns true. Whether it did.
  template <class Sink>
  bool listen(Duration wall, Sink&& sink) {
    const auto end = std::chrono::steady_clock::now() + wall;
    bool enough = false;
    while (!enough && port_.wait(end - std::chrono::steady_clock::now())) {
      std::array<std::uint8_t, 512> buffer;
      const std::size_t n = port_.read(buffer);
      parser_.push(std::span<const std::uint8_t>(buffer).first(n),
                   [&](const Packet& packet, std::uint64_t) { enough = sink(packet) || enough; });
    }
    return enough;
  }
  /// Discards a frame that was never completed. Whether there was one.
  bool resynchronise() noexcept;
  [[nodiscard]] const Parser::Counters& parsed() const noexcept { return parser_.counters(); }
  /// The coast three times, to this id and to all.
  void coast(int module_id);

 private:
  bool send(std::span<const std::uint8_t> bytes);

  serial::Port port_;
  Parser parser_;
};

struct SerialLine {
  std::string device;  ///< as serial::Port takes it
  unsigned baud = 115200;
  int module_id = 0;  ///< 0..62
};

/// A dialogue on a serial port, one question at a time, without a thread: for inspecting a module, not for measuring.
/// The motor coasts from the beginning to the end, confirmed.
class SerialDialogue final : public Dialogue {
 public:
  /// Opens the port exclusively, coasts, and asks until the module reports drive mode coast. Throws DeviceError: port
  /// missing or in use, no module answers, or it does not coast. `clock` must outlive the dialogue.
  SerialDialogue(const SerialLine& port, const Clock& clock);
  /// Coasts.
  ~SerialDialogue() override;
  SerialDialogue(const SerialDialogue&) = delete;
  SerialDialogue& operator=(const SerialDialogue&) = delete;

  /// Two attempts. Each waits for ten of the round trips measured so far, 20 to 100 ms of wall time, and after a
  /// failure as long again for a late reply to pass.
  std::optional<Answer> ask(const Entry& entry) override;
  void pause(Duration bench) override;

  /// The path that was opened.
  [[nodiscard]] const std::string& device() const noexcept { return line_.device(); }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  /// Median of question to reply, with their time on the wire; wall time. Zero before the first.
  [[nodiscard]] Duration median_round_trip() const;
  /// Round trip and line, judged: slow answers, noise.
  [[nodiscard]] std::vector<Finding> findings() const;

 private:
  void send(const Entry& entry, double value) override;
  void coast() noexcept;
  void prove_coast();
  void write(const Packet& packet);
  std::optional<Answer> ask_once(const Entry& entry);
  void learn(Duration round_trip);
  [[nodiscard]] Duration patience() const noexcept;
  [[nodiscard]] bool answers(const Packet& packet, const Entry& asked) noexcept;
  [[noreturn]] void lose(const char* operation, const std::string& cause) const;

  const SerialLine port_;
  const Clock& clock_;
  Conversation line_;
  Counters counters_;
  std::vector<Duration> round_trips_;  ///< the last 5000 or more
  Duration typical_round_trip_{0};
};

}  // namespace kphi::iq
