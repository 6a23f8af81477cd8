#include "drivers/sim/netbox/device.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/sim/physics/motor.hpp"
#include "drivers/sim/transport/bytes.hpp"

namespace kphi::sim {
namespace {

constexpr std::uint32_t kHeader = 0x1234;
constexpr std::uint32_t kErrorSummary = 1u << 31;
constexpr std::uint32_t kSaturated = 1u << 17;
constexpr std::uint32_t kSaturatedAxia = 1u << 30;
constexpr std::uint32_t kConditionLatched = 1u << 16;
constexpr int kPauseTicks = 350;  // of RateWrite::pauses

enum Command : std::uint32_t {
  kStop = 0x0000,
  kStartSingle = 0x0001,
  kStartRealTime = 0x0002,
  kStartBuffered = 0x0003,
  kStartMultiUnit = 0x0004,
  kResetLatch = 0x0041,
  kSetBias = 0x0042,
};

int divisor_of(double rate_hz) noexcept {
  return std::clamp(static_cast<int>(std::floor(kTicksPerSecond / std::max(rate_hz, 1.0))), 1, kTicksPerSecond);
}

NetBoxSettings within_limits(NetBoxSettings settings) {
  settings.records_per_datagram =
      std::clamp(settings.records_per_datagram, 1, static_cast<int>(kRecordsPerDatagramMax));
  settings.active_slot = std::clamp(settings.active_slot, 0, kSlots - 1);
  settings.filter = std::clamp(settings.filter, 0, static_cast<int>(kFilterCutoffsHz.size()) - 1);
  return settings;
}

constexpr std::size_t kCommandBytes = 20;  // on TCP
constexpr double kFullScale = 32767;

enum TcpCommand : std::uint8_t { kReadForces = 0, kReadCalibration = 1 };

void append16(std::string& out, std::uint32_t value) {
  out += static_cast<char>(value >> 8 & 0xff);
  out += static_cast<char>(value & 0xff);
}
void append32(std::string& out, std::uint32_t value) {
  append16(out, value >> 16);
  append16(out, value & 0xffff);
}

/// Counts per TCP count: the full range fills 16 bits.
std::int32_t scale_factor(const NetBoxDevice& box, std::size_t axis) {
  const double counts = box.settings().range[axis] * box.signal().counts_per_si(axis);
  return static_cast<std::int32_t>(std::clamp(std::round(counts / kFullScale), 1.0, 65535.0));
}

}  // namespace

Datagram& Datagram::operator=(const Datagram& other) noexcept {
  peer = other.peer;
  at = other.at;
  boot = other.boot;
  stream = other.stream;
  foreign = other.foreign;
  size = other.size;
  std::copy_n(other.bytes.begin(), size, bytes.begin());
  std::copy_n(other.sampled.begin(), std::min(size / kRecordBytes, sampled.size()), sampled.begin());
  return *this;
}

NetBoxDevice::NetBoxDevice(const NetBoxSettings& settings)
    : settings_(within_limits(settings)),
      signal_(settings_),
      divisor_(divisor_of(settings.rate_hz)),
      ft_sequence_(settings.first_ft_sequence - 1) {}

void NetBoxDevice::receive(std::span<const std::uint8_t> datagram, Peer peer) {
  if (datagram.size() != 8 || big(datagram.first(2)) != kHeader || !settings_.rdt_enabled) {
    ++requests_ignored_;
    return;
  }
  apply(big(datagram.subspan(2, 2)), big(datagram.subspan(4, 4)), peer);
}

void NetBoxDevice::apply(std::uint32_t command, std::uint32_t sample_count, Peer peer) {
  const bool axia = settings_.quirks.axia;
  const int block = settings_.records_per_datagram;
  switch (command) {
    case kStop:
      return stop();
    case kStartSingle:
      if (axia) return start(peer, 1, sample_count);
      break;
    case kStartRealTime:
      return start(peer, axia ? block : 1, sample_count);
    case kStartBuffered:
      if (!axia) return start(peer, block, sample_count);
      break;
    case kStartMultiUnit:
      if (!axia && settings_.quirks.command_four_streams) return start(peer, 1, sample_count);
      break;
    case kResetLatch:
      if (!axia) return signal_.reset_latch();
      break;
    case kSetBias:
      return bias();
    default:
      break;
  }
  ++requests_ignored_;
}

void NetBoxDevice::start(Peer peer, int records_per_datagram, std::uint32_t sample_count) noexcept {
  streaming_ = true;
  finite_ = sample_count != 0;
  remaining_ = sample_count;
  records_per_datagram_ = static_cast<std::size_t>(records_per_datagram);
  ticks_to_record_ = 0;
  open_.peer = peer;
  restart_stream();
}

void NetBoxDevice::restart_stream() noexcept {
  ++streams_;
  rdt_sequence_ = 0;
  open_.size = 0;
}

void NetBoxDevice::stop() noexcept {
  streaming_ = false;
  open_.size = 0;
}

void NetBoxDevice::bias() noexcept {
  signal_.take_software_bias();
  if (settings_.quirks.bias_stops_stream) stop();
}

void NetBoxDevice::power_cycle(bool resume) {
  ++boots_;
  ft_sequence_ = 0xffffffffu;
  forced_status_ = 0;
  stalled_ = false;
  peaks_high_ = peaks_low_ = {};
  signal_ = NetBoxSignal(settings_);
  if (resume && streaming_) {
    ticks_to_record_ = 0;
    restart_stream();
  } else {
    stop();
  }
}

void NetBoxDevice::configure(const NetBoxSettings& settings) {
  const int before = divisor_;
  settings_ = within_limits(settings);
  divisor_ = divisor_of(settings_.rate_hz);
  signal_.configure(settings_);
  if (!settings_.rdt_enabled) stop();
  if (divisor_ == before || !streaming_) return;
  using RateWrite = NetBoxQuirks::RateWrite;
  if (settings_.quirks.rate_write == RateWrite::stops) stop();
  ticks_to_record_ = settings_.quirks.rate_write == RateWrite::pauses ? kPauseTicks : 0;
}

void NetBoxDevice::sample(const LoadCellSample& sample) {
  ++ticks_;
  if (!stalled_) {
    ++ft_sequence_;
    measure(sample.wrench);
  }
  if (!streaming_) return;
  if (ticks_to_record_ == 0) {
    append_record(sample.at);
    ticks_to_record_ = divisor_;
  }
  --ticks_to_record_;
}

void NetBoxDevice::measure(const Wrench& wrench) noexcept {
  signal_.measure(wrench);
  status_ = forced_status_;
  if (signal_.saturated()) status_ |= kErrorSummary | (settings_.quirks.axia ? kSaturatedAxia : kSaturated);
  if (signal_.latched()) status_ |= kErrorSummary | kConditionLatched;
  if (!settings_.peaks) return;
  const auto& counts = signal_.counts();
  for (std::size_t axis = 0; axis < counts.size(); ++axis) {
    peaks_high_[axis] = std::max(peaks_high_[axis], counts[axis]);
    peaks_low_[axis] = std::min(peaks_low_[axis], counts[axis]);
  }
}

void NetBoxDevice::append_record(Instant at) {
  std::uint8_t* to = open_.bytes.data() + open_.size;
  put_big(to, ++rdt_sequence_);
  put_big(to + 4, ft_sequence_);
  put_big(to + 8, status_);
  const auto& counts = signal_.counts();
  for (std::size_t axis = 0; axis < counts.size(); ++axis) {
    put_big(to + 12 + 4 * axis, static_cast<std::uint32_t>(counts[axis]));
  }
  open_.sampled[open_.size / kRecordBytes] = at;
  open_.size += kRecordBytes;
  open_.at = at;
  ++records_sent_;
  using LastBlock = NetBoxQuirks::LastBlock;
  const bool full = open_.size == records_per_datagram_ * kRecordBytes;
  if (finite_ && remaining_ > 0) --remaining_;
  const bool last = finite_ && remaining_ == 0;
  if (full || (last && settings_.quirks.last_block == LastBlock::partial)) close_datagram();
  if (last && (full || settings_.quirks.last_block != LastBlock::padded)) stop();
}

void NetBoxDevice::close_datagram() {
  const auto payload = open_.payload();
  waiting_.push_back(
      {open_.peer, open_.at, boots_, streams_, waiting_bytes_.size(), payload.size(), waiting_instants_.size()});
  waiting_bytes_.insert(waiting_bytes_.end(), payload.begin(), payload.end());
  waiting_instants_.insert(waiting_instants_.end(), open_.sampled.begin(),
                           open_.sampled.begin() + static_cast<std::ptrdiff_t>(payload.size() / kRecordBytes));
  open_.size = 0;
}

bool NetBoxDevice::next_datagram(Datagram& out) {
  if (next_ == waiting_.size()) return false;
  const Waiting& waiting = waiting_[next_++];
  out.peer = waiting.peer;
  out.at = waiting.at;
  out.boot = waiting.boot;
  out.stream = waiting.stream;
  out.foreign = false;
  out.size = waiting.size;
  std::copy_n(waiting_bytes_.data() + waiting.offset, waiting.size, out.bytes.data());
  std::copy_n(waiting_instants_.data() + waiting.first_instant, waiting.size / kRecordBytes, out.sampled.data());
  if (next_ == waiting_.size()) {
    waiting_.clear();
    waiting_bytes_.clear();
    waiting_instants_.clear();
    next_ = 0;
  }
  return true;
}

// --- TCP 49151: commands of 20 bytes, 16 bits per axis (manual, TCP interface)

std::string NetBoxDevice::tcp(std::string& received) {
  std::string answers;
  while (received.size() >= kCommandBytes) {
    std::array<std::uint8_t, kCommandBytes> command{};
    std::copy_n(received.begin(), kCommandBytes, command.begin());
    received.erase(0, kCommandBytes);
    answer_tcp(command, answers);
  }
  return answers;
}

void NetBoxDevice::answer_tcp(std::span<const std::uint8_t> command, std::string& out) {
  if (command[0] == kReadForces) {
    const std::uint32_t enabled = big(command.subspan(16, 2));
    const std::uint32_t orders = big(command.subspan(18, 2));
    for (std::size_t i = 0; i < settings_.conditions.size(); ++i)
      settings_.conditions[i].enabled = (enabled >> i & 1u) != 0;
    signal_.configure(settings_);
    if ((orders & 1u) != 0) bias();
    if ((orders & 2u) != 0) signal_.reset_latch();
    append16(out, kHeader);
    append16(out, status_ >> 16);
    for (std::size_t axis = 0; axis < 6; ++axis) {
      const double coarse = std::round(static_cast<double>(signal_.counts()[axis]) / scale_factor(*this, axis));
      append16(out, static_cast<std::uint32_t>(static_cast<std::int32_t>(std::clamp(coarse, -32768.0, 32767.0))));
    }
  } else if (command[0] == kReadCalibration) {
    const Slot& slot = settings_.slots[static_cast<std::size_t>(settings_.active_slot)];
    append16(out, kHeader);
    out += static_cast<char>(slot.force_unit);
    out += static_cast<char>(slot.torque_unit);
    append32(out, static_cast<std::uint32_t>(counts_per_force(settings_, settings_.active_slot)));
    append32(out, static_cast<std::uint32_t>(counts_per_torque(settings_, settings_.active_slot)));
    for (std::size_t axis = 0; axis < 6; ++axis) append16(out, static_cast<std::uint32_t>(scale_factor(*this, axis)));
  }
}

}  // namespace kphi::sim
