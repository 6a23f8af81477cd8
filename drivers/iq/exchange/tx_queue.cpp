#include "drivers/iq/exchange/tx_queue.hpp"

#include <algorithm>
#include <array>

namespace kphi::iq {
namespace {

constexpr std::ptrdiff_t kWaitingCoasts = 3;

}  // namespace

bool TxQueue::push(Kind kind, const Packet& packet) noexcept {
  if (frames_.size() == kFrames) return false;
  insert(frames_.size(), kind, packet);
  return true;
}

bool TxQueue::push_coast(const Packet& packet, bool padded) noexcept {
  for (std::size_t i = frames_.size(); i > first_whole(); --i) {
    if (frames_[i - 1].kind == Kind::motion) erase(i - 1);
  }
  const auto waits = [](const Frame& frame) { return frame.kind == Kind::coast; };
  if (std::count_if(frames_.begin() + first_whole(), frames_.end(), waits) >= kWaitingCoasts) return false;
  if (frames_.size() == kFrames) erase(kFrames - 1);
  insert(first_whole(), Kind::coast, packet, padded ? kPadding : 0);
  return true;
}

std::size_t TxQueue::withdraw() noexcept {
  const std::size_t before = bytes_.size();
  for (std::size_t i = frames_.size(); i > first_whole(); --i) {
    if (frames_[i - 1].kind != Kind::coast) erase(i - 1);
  }
  return before - bytes_.size();
}

void TxQueue::sent(std::size_t n) noexcept {
  n = std::min(n, bytes_.size());
  bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(n));
  while (n > 0) {
    Frame& first = frames_.front();
    const std::size_t left = std::min(n, first.size);
    n -= left;
    first.size -= left;
    begun_ = first.size > 0;
    if (!begun_) frames_.erase(frames_.begin());
  }
}

void TxQueue::insert(std::size_t at, Kind kind, const Packet& packet, std::size_t padding) noexcept {
  std::array<std::uint8_t, kMaxFrame> frame;
  const std::size_t size = encode(packet, frame);
  const auto place = bytes_.insert(bytes_.begin() + offset(at), frame.begin(), frame.begin() + size);
  bytes_.insert(place, padding, std::uint8_t{0});
  frames_.insert(frames_.begin() + at, Frame{kind, padding + size});
}

void TxQueue::erase(std::size_t at) noexcept {
  const auto place = bytes_.begin() + offset(at);
  bytes_.erase(place, place + static_cast<std::ptrdiff_t>(frames_[at].size));
  frames_.erase(frames_.begin() + at);
}

std::ptrdiff_t TxQueue::offset(std::size_t at) const noexcept {
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < at; ++i) bytes += frames_[i].size;
  return static_cast<std::ptrdiff_t>(bytes);
}

}  // namespace kphi::iq
