#include "drivers/iq/dialogue.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace kphi::iq {

void Dialogue::tell(const Entry& entry, double value) {
  if (!is_volatile_setting(entry)) {
    throw std::logic_error(fmt::format("{}.{} is no setting", name_of(entry.type), entry.name));
  }
  send(entry, value);
}

}  // namespace kphi::iq
