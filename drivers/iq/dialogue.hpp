// One module, asked entry by entry: what audits and checks need of a link, and nothing more. Cannot command motion.
#pragma once

#include <optional>

#include "drivers/clock.hpp"
#include "drivers/iq/entries.hpp"

namespace kphi::iq {

struct Answer {
  double value = 0;         ///< in the entry's unit
  Instant time{0};          ///< bench time: the middle of the span in which the module read the value
  Duration uncertainty{0};  ///< half of that span: from the end of the question to the beginning of the reply
};

class Dialogue {
 public:
  virtual ~Dialogue() = default;
  /// Nothing when no answer came in time, after such retries as the dialogue thinks fit: this firmware does not know
  /// the entry. Throws DeviceError when the line is gone.
  virtual std::optional<Answer> ask(const Entry& entry) = 0;
  /// Sets until the next reboot; never answered. Throws std::logic_error unless is_volatile_setting.
  void tell(const Entry& entry, double value);
  /// Returns after this much bench time.
  virtual void pause(Duration bench) = 0;

 private:
  virtual void send(const Entry& entry, double value) = 0;
};

}  // namespace kphi::iq
