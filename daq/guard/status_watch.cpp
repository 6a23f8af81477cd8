#include "daq/guard/status_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "daq/bench/device_records.hpp"

namespace kphi::daq {
namespace {

using netbox::StatusVerdict;

constexpr std::uint32_t kOfSession = netbox::kErrorSummary | netbox::kMonitorCondition | netbox::kStreamTrouble;

bool is_reported_elsewhere(StatusVerdict verdict, std::uint32_t status) {
  return verdict == StatusVerdict::saturated ||
         (verdict == StatusVerdict::communication && (status & ~kOfSession) == 0);
}

const char* next_move(StatusVerdict verdict) {
  if (verdict == StatusVerdict::saturated) return "take the load off the cell, then run: kphi devices";
  if (verdict == StatusVerdict::communication) return "check the box's network and field bus, then run: kphi devices";
  return "check the cell's cable and the box's supply, switch the box off and on, then run: kphi devices";
}

}  // namespace

StatusWatch::StatusWatch(netbox::Product product, int records_per_datagram, double sample_rate_hz)
    : product_(product), sample_rate_hz_(sample_rate_hz) {
  faulty_.patience = static_cast<std::uint64_t>(std::max(1, records_per_datagram));
  bad_.patience = std::max(faulty_.patience, static_cast<std::uint64_t>(std::ceil(kLasting * sample_rate_hz)));
}

void StatusWatch::Count::add(bool bad) noexcept {
  if (bad) {
    value = std::min(value + 1, patience + 1);
  } else if (value > 0) {
    --value;
  }
}

StatusWatch::State StatusWatch::take(const LoadCellRecord& sample) {
  const StatusVerdict verdict = netbox::verdict_of(sample.status, product_);
  const bool sound = verdict == StatusVerdict::sound;
  if (bad_.value == 0) {
    if (sound) return State::trusted;
    episode_ = {};
  }
  faulty_.add(verdict == StatusVerdict::faulty);
  bad_.add(!sound);
  ++episode_.samples;
  if (sound) {
    if (episode_.sound_since == 0) episode_.sound_since = sample.arrival_ns;
    if (bad_.value == 0) note_end();
    return State::trusted;
  }
  status_ = sample.status;
  ++episode_.bad;
  episode_.sound_since = 0;
  if (!told_ && !is_reported_elsewhere(verdict, sample.status)) note_error(sample);
  if (verdict == StatusVerdict::faulty && faulty_.is_over()) return State::untrusted;
  return bad_.is_over() ? State::lasting : State::trusted;
}

std::optional<StreamEvent> StatusWatch::take_event() { return std::exchange(event_, std::nullopt); }

std::string StatusWatch::error() const {
  return fmt::format("the {} reports \"{}\" (status 0x{:08X})", netbox::name_of(product_),
                     fmt::join(netbox::names(status_, product_), ", "), status_);
}

std::string StatusWatch::reason() const {
  const double lasts_ms = 1e3 * static_cast<double>(episode_.samples) / sample_rate_hz_;
  return fmt::format("load cell: {} for {:.1f} ms, so its samples cannot be trusted; {}", error(), lasts_ms,
                     next_move(netbox::verdict_of(status_, product_)));
}

void StatusWatch::note_error(const LoadCellRecord& sample) {
  told_ = episode_.told = true;
  event_ = event_at(sample.arrival(), EventKind::box_error, error());
}

void StatusWatch::note_end() {
  if (!episode_.told) return;
  event_ = event_at(
      Instant(episode_.sound_since), EventKind::box_error_ended,
      fmt::format("the {} no longer reports an error, after {} bad samples", netbox::name_of(product_), episode_.bad),
      episode_.bad);
}

}  // namespace kphi::daq
