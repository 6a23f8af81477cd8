#include "drivers/sim/netbox/device.hpp"

#include <algorithm>
#include <boost/endian/conversion.hpp>
#include <cmath>

#include "drivers/sim/physics/motor.hpp"
#include "drivers/sim/transport/bytes.hpp"

namespace kphi::sim {
namespace {

using namespace boost::endian;

constexpr std::uint32_t kHeader = 0x1234;
constexpr std::uint32_t kErrorSummary = 1u << 31;
constexpr std::uint32_t kSaturated = 1u << 17;
constexpr std::uint32_t kSaturatedAxia = 1u << 30;
constexpr int kPauseTicks = 350;  // of RateWrite::pauses

enum Command : std::uint32_t {
  kStop = 0x0000,
  kStartSingle = 0x0001,
  kStartRealTime = 0x0002,
  kStartBuffered = 0x0003,
  kStartMultiUnit = 0x0004,
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

constexpr char kReadCalibration = 1;

}  // namespace

NetBoxDevice::NetBoxDevice(const NetBoxSettings& settings)
    : settings_(within_limits(settings)),
      signal_(settings_),
      divisor_(divisor_of(settings.rate_hz)),
      ft_sequence_(settings.first_ft_sequence - 1) {}

void NetBoxDevice::receive(std::span<const std::uint8_t> datagram, Peer peer) {
  if (datagram.size() != 8 || load_big_u16(datagram.data()) != kHeader) return;
  const std::uint32_t command = load_big_u16(datagram.data() + 2), samples = load_big_u32(datagram.data() + 4);
  const bool axia = settings_.quirks.axia;
  const int block = settings_.records_per_datagram;
  if (command == kStop) stop();
  if (command == kStartSingle && axia) start(peer, 1, samples);
  if (command == kStartRealTime) start(peer, axia ? block : 1, samples);
  if (command == kStartBuffered && !axia) start(peer, block, samples);
  if (command == kStartMultiUnit && !axia) start(peer, 1, samples);
  if (command != kSetBias) return;
  signal_.take_software_bias();
  if (settings_.quirks.bias_stops_stream) stop();
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
  const auto& counts = signal_.counts();
  for (std::size_t axis = 0; axis < counts.size(); ++axis) {
    peaks_high_[axis] = std::max(peaks_high_[axis], counts[axis]);
    peaks_low_[axis] = std::min(peaks_low_[axis], counts[axis]);
  }
}

void NetBoxDevice::append_record(Instant at) {
  std::uint8_t* to = open_.bytes.data() + open_.size;
  store_big_u32(to, ++rdt_sequence_);
  store_big_u32(to + 4, ft_sequence_);
  store_big_u32(to + 8, status_);
  const auto& counts = signal_.counts();
  for (std::size_t axis = 0; axis < counts.size(); ++axis) {
    store_big_u32(to + 12 + 4 * axis, static_cast<std::uint32_t>(counts[axis]));
  }
  open_.sampled[open_.size / kRecordBytes] = at;
  open_.size += kRecordBytes;
  open_.at = at;
  ++records_sent_;
  using LastBlock = NetBoxQuirks::LastBlock;
  const bool full = open_.size == records_per_datagram_ * kRecordBytes;
  if (finite_ && remaining_ > 0) --remaining_;
  const bool last = finite_ && remaining_ == 0;
  if (full || (last && settings_.quirks.last_block == LastBlock::partial)) {
    open_.boot = boots_;
    open_.stream = streams_;
    waiting_.push_back(open_);
    open_.size = 0;
  }
  if (last && (full || settings_.quirks.last_block != LastBlock::padded)) stop();
}

bool NetBoxDevice::next_datagram(Datagram& out) {
  if (waiting_.empty()) return false;
  out = waiting_.front();
  waiting_.pop_front();
  return true;
}

// --- TCP 49151: commands of 20 bytes (manual, TCP interface)

std::string NetBoxDevice::tcp(std::string& received) const {
  std::string answers;
  for (; received.size() >= kCommandBytes; received.erase(0, kCommandBytes))
    if (received[0] == kReadCalibration) append_calibration(answers);
  return answers;
}

void NetBoxDevice::append_calibration(std::string& out) const {
  const Slot& slot = settings_.slots[static_cast<std::size_t>(settings_.active_slot)];
  append_big(out, kHeader, 2);
  out += static_cast<char>(slot.force_unit);
  out += static_cast<char>(slot.torque_unit);
  append_big(out, static_cast<std::uint32_t>(counts_per_force(settings_, settings_.active_slot)), 4);
  append_big(out, static_cast<std::uint32_t>(counts_per_torque(settings_, settings_.active_slot)), 4);
  // Counts per TCP count: the full range fills 16 bits.
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double counts = settings_.range[axis] * signal_.counts_per_si(axis);
    append_big(out, static_cast<std::uint32_t>(std::clamp(std::round(counts / kFullScale), 1.0, 65535.0)), 2);
  }
}

}  // namespace kphi::sim
