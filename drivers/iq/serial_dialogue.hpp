// A dialogue with the module on a serial port, one question at a time, without a thread: for looking at a module, not
// for measuring with it. The motor coasts from the beginning to the end, and is proven to.
#pragma once

#include <string>
#include <vector>

#include "drivers/finding.hpp"
#include "drivers/iq/conversation.hpp"
#include "drivers/iq/dialogue.hpp"
#include "drivers/iq/reading.hpp"

namespace kphi::iq {

struct DialoguePlace {
  std::string device;  ///< as serial::Port takes it
  unsigned baud = 115200;
  int module_id = 0;  ///< 0..62
};

class SerialDialogue final : public Dialogue {
 public:
  /// Opens the port exclusively, coasts, and asks until drive mode coast is told. Throws DeviceError: port missing or
  /// in use, no module answers, or it does not coast. `clock` must outlive the dialogue.
  SerialDialogue(const DialoguePlace& place, const Clock& clock);
  /// Coasts.
  ~SerialDialogue() override;
  SerialDialogue(const SerialDialogue&) = delete;
  SerialDialogue& operator=(const SerialDialogue&) = delete;

  /// Two attempts. Each waits for ten round trips as they have been so far, 20 to 100 ms of wall time, and after a
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
  void count_parser() noexcept;
  [[noreturn]] void lose(const char* operation, const std::string& cause) const;

  const DialoguePlace place_;
  const Clock& clock_;
  Conversation line_;
  Counters counters_;
  std::vector<Duration> round_trips_;  ///< the last 5000 or more
  Duration typical_round_trip_{0};
};

}  // namespace kphi::iq
