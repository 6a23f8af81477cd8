#include "drivers/iq/bus.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace kphi::iq {
namespace {

std::uint64_t ids_of(const std::vector<Settings>& modules) {
  std::uint64_t ids = 0;
  for (const Settings& settings : modules) {
    const std::uint64_t id = std::uint64_t{1} << completed(settings).module_id;
    if ((ids & id) != 0) throw std::invalid_argument(fmt::format("two modules with id {}", settings.module_id));
    ids |= id;
  }
  return ids;
}

}  // namespace

Bus::Bus(const std::vector<Settings>& modules) {
  if (modules.empty()) throw std::invalid_argument("a line without a module");
  const std::uint64_t ids = ids_of(modules);
  sessions_.reserve(modules.size());
  for (const Settings& settings : modules) {
    Session& session = sessions_.emplace_back(settings);
    session.set_neighbours(ids & ~(std::uint64_t{1} << settings.module_id));
    session.hold(modules.size() > 1);
  }
}

void Bus::connect_anew(Instant now) {
  output_.clear();
  for (Session& session : sessions_) session.connect_anew(now);
  settle(now);
}

void Bus::lose(const std::string& why, Instant now) {
  for (Session& session : sessions_) session.fail(EventKind::port_lost, why, now);
}

void Bus::emergency_stop(Instant now) {
  if (size() > 1) {
    std::array<std::uint8_t, kMaxFrame> frame;
    const auto all = static_cast<int>(ModuleId::broadcast);
    const auto n = static_cast<std::ptrdiff_t>(encode(set<"propeller_motor_control.ctrl_coast">(all), frame));
    output_.insert(output_.end(), frame.begin(), frame.begin() + n);
  }
  for (Session& session : sessions_) session.emergency_stop(now);
}

void Bus::receive(std::span<const std::uint8_t> bytes, Instant now) {
  for (Session& session : sessions_) session.receive(bytes, now);
  settle(now);
}

void Bus::advance(Instant now) {
  for (Session& session : sessions_) session.advance(now);
  settle(now);
}

void Bus::settle(Instant now) {
  if (size() == 1) return;
  stop_for_the_silent(now);
  collect();
  pass_the_line(now);
}

void Bus::stop_for_the_silent(Instant now) {
  for (const Session& silent : sessions_) {
    if (!silent.silent()) continue;
    for (Session& other : sessions_) {
      if (other.state() == Session::State::failed) continue;
      other.fail(EventKind::coast_denied,
                 fmt::format("module {} on the same line does not confirm its coast", silent.settings().module_id),
                 now);
    }
  }
}

// Each turn is one batch: what is due now and fits into the module's receive buffer.
void Bus::pass_the_line(Instant now) {
  for (std::size_t turns = 0; turns < size() && sessions_[speaker_].quiet(); ++turns) {
    speaker_ = (speaker_ + 1) % size();
    Session& next = sessions_[speaker_];
    next.hold(false);
    next.advance(now);
    next.hold(true);
  }
}

std::span<const std::uint8_t> Bus::output() {
  if (size() == 1) return sessions_[0].output();
  collect();
  return output_;
}

void Bus::collect() {
  for (Session& session : sessions_) {
    const auto bytes = session.output();
    output_.insert(output_.end(), bytes.begin(), bytes.end());
    session.sent(bytes.size());
  }
}

void Bus::sent(std::size_t n) noexcept {
  if (size() == 1) return sessions_[0].sent(n);
  output_.erase(output_.begin(), output_.begin() + static_cast<std::ptrdiff_t>(n));
}

Instant Bus::deadline() const noexcept {
  Instant earliest = kNever;
  for (const Session& session : sessions_) earliest = std::min(earliest, session.deadline());
  return earliest;
}

}  // namespace kphi::iq
