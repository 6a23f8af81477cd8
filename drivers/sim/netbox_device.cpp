#include "drivers/sim/netbox_device.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/sim/bytes.hpp"
#include "drivers/sim/motor.hpp"
#include "drivers/sim/netbox_pages.hpp"

namespace kphi::sim {
namespace {

constexpr std::uint32_t kHeader = 0x1234;
constexpr std::uint32_t kSaturated = 1u << 17;
constexpr std::uint32_t kErrorSummary = 1u << 31;

enum Command : std::uint32_t {
  kStop = 0x0000,
  kStartRealTime = 0x0002,
  kStartBuffered = 0x0003,
  kStartMultiUnit = 0x0004,
  kResetLatch = 0x0041,
  kSetBias = 0x0042,
};

int divisor_of(double rate_hz) noexcept {
  return std::clamp(static_cast<int>(std::floor(kTicksPerSecond / std::max(rate_hz, 1.0))), 1, kTicksPerSecond);
}

}  // namespace

NetBoxDevice::NetBoxDevice(const NetBoxSettings& settings)
    : settings_(settings), divisor_(divisor_of(settings.rate_hz)), ft_sequence_(settings.first_ft_sequence - 1) {
  settings_.records_per_datagram =
      std::clamp(settings.records_per_datagram, 1, static_cast<int>(kRecordsPerDatagramMax));
}

void NetBoxDevice::receive(std::span<const std::uint8_t> datagram, Peer peer) {
  if (datagram.size() != 8 || big(datagram.first(2)) != kHeader) {
    ++requests_ignored_;
    return;
  }
  const std::uint32_t sample_count = big(datagram.subspan(4, 4));
  switch (big(datagram.subspan(2, 2))) {
    case kStop:
      return stop();
    case kStartRealTime:
      return start(peer, 1, sample_count);
    case kStartBuffered:
      return start(peer, settings_.records_per_datagram, sample_count);
    case kStartMultiUnit:
      return start(peer, 1, sample_count);
    case kResetLatch:
      return;       // no monitor condition is set, so nothing is latched
    case kSetBias:  // the stream goes on
      for (std::size_t axis = 0; axis < bias_.size(); ++axis) bias_[axis] += counts_[axis];
      return;
    default:
      ++requests_ignored_;
  }
}

void NetBoxDevice::start(Peer peer, int records_per_datagram, std::uint32_t sample_count) noexcept {
  streaming_ = true;
  finite_ = sample_count != 0;
  remaining_ = sample_count;
  rdt_sequence_ = 0;
  records_per_datagram_ = static_cast<std::size_t>(records_per_datagram);
  ticks_to_record_ = 0;
  open_.peer = peer;
  open_.size = 0;
}

void NetBoxDevice::stop() noexcept {
  streaming_ = false;
  open_.size = 0;
}

void NetBoxDevice::sample(const LoadCellSample& sample) {
  ++ft_sequence_;
  measure(sample.wrench);
  if (!streaming_) return;
  if (ticks_to_record_ == 0) {
    append_record(sample.at);
    ticks_to_record_ = divisor_;
  }
  --ticks_to_record_;
}

void NetBoxDevice::measure(const Wrench& wrench) noexcept {
  status_ = 0;
  for (std::size_t axis = 0; axis < wrench.size(); ++axis) {
    const double range = settings_.range[axis];
    double value = wrench[axis];
    if (value > range || value < -range) {
      value = value > 0 ? range : -range;
      status_ = kSaturated | kErrorSummary;
    }
    const double counts = value * (axis < 3 ? settings_.counts_per_force : settings_.counts_per_torque);
    counts_[axis] = static_cast<std::int32_t>(counts + (counts < 0 ? -0.5 : 0.5)) - bias_[axis];
    peaks_high_[axis] = std::max(peaks_high_[axis], counts_[axis]);
    peaks_low_[axis] = std::min(peaks_low_[axis], counts_[axis]);
  }
}

void NetBoxDevice::append_record(Instant at) {
  std::uint8_t* to = open_.bytes.data() + open_.size;
  put_big(to, ++rdt_sequence_);
  put_big(to + 4, ft_sequence_);
  put_big(to + 8, status_);
  for (std::size_t axis = 0; axis < counts_.size(); ++axis) {
    put_big(to + 12 + 4 * axis, static_cast<std::uint32_t>(counts_[axis]));
  }
  open_.size += kRecordBytes;
  open_.at = at;
  ++records_sent_;
  const bool last = finite_ && --remaining_ == 0;
  if (last || open_.size == records_per_datagram_ * kRecordBytes) close_datagram();
  if (last) stop();
}

void NetBoxDevice::close_datagram() {
  const auto payload = open_.payload();
  waiting_.push_back({open_.peer, open_.at, waiting_bytes_.size(), payload.size()});
  waiting_bytes_.insert(waiting_bytes_.end(), payload.begin(), payload.end());
  open_.size = 0;
}

bool NetBoxDevice::next_datagram(Datagram& out) {
  if (next_ == waiting_.size()) return false;
  const Waiting& waiting = waiting_[next_++];
  out.peer = waiting.peer;
  out.at = waiting.at;
  out.size = waiting.size;
  std::copy_n(waiting_bytes_.begin() + static_cast<std::ptrdiff_t>(waiting.offset), waiting.size, out.bytes.begin());
  if (next_ == waiting_.size()) {
    waiting_.clear();
    waiting_bytes_.clear();
    next_ = 0;
  }
  return true;
}

std::string NetBoxDevice::http(std::string_view request) const { return netbox_answer(*this, request); }

}  // namespace kphi::sim
