#include "drivers/iq/exchange/tx_queue.hpp"

#include <algorithm>

namespace kphi::iq {

bool TxQueue::push(Kind kind, const Packet& packet) noexcept {
  if (count_ == kFrames) return false;
  insert(count_, kind, packet);
  const Frame& frame = frames_[count_ - 1];
  const std::size_t skipped = count_ == 1 ? begun_ : 0;
  std::copy_n(frame.bytes.begin() + skipped, frame.size - skipped, wire_.begin() + wire_size_);
  wire_size_ += frame.size - skipped;
  return true;
}

bool TxQueue::push_coast(const Packet& packet, bool padded) noexcept {
  std::size_t waiting = 0;
  for (std::size_t i = first_whole(); i < count_;) {
    if (frames_[i].kind == Kind::motion) {
      erase(i);
    } else {
      waiting += frames_[i].kind == Kind::coast ? 1 : 0;
      ++i;
    }
  }
  const bool has_room = waiting < kWaitingCoasts;
  if (has_room) {
    if (count_ == kFrames) erase(count_ - 1);
    insert(first_whole(), Kind::coast, packet, padded ? kPadding : 0);
  }
  lay_out();
  return has_room;
}

std::size_t TxQueue::withdraw() noexcept {
  const std::size_t before = wire_size_;
  for (std::size_t i = count_; i > first_whole(); --i) {
    if (frames_[i - 1].kind != Kind::coast) erase(i - 1);
  }
  lay_out();
  return before - wire_size_;
}

void TxQueue::clear() noexcept { count_ = begun_ = wire_size_ = 0; }

void TxQueue::sent(std::size_t n) noexcept {
  n += begun_;
  while (count_ > 0 && n >= frames_[0].size) {
    n -= frames_[0].size;
    erase(0);
  }
  begun_ = count_ > 0 ? n : 0;
  lay_out();
}

void TxQueue::insert(std::size_t at, Kind kind, const Packet& packet, std::size_t padding) noexcept {
  std::move_backward(frames_.begin() + at, frames_.begin() + count_, frames_.begin() + count_ + 1);
  Frame& frame = frames_[at];
  frame.kind = kind;
  std::fill_n(frame.bytes.begin(), padding, std::uint8_t{0});
  frame.size = padding + encode(packet, std::span(frame.bytes).subspan(padding).first<kMaxFrame>());
  ++count_;
}

void TxQueue::erase(std::size_t at) noexcept {
  std::move(frames_.begin() + at + 1, frames_.begin() + count_, frames_.begin() + at);
  --count_;
}

void TxQueue::lay_out() noexcept {
  wire_size_ = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const std::size_t skipped = i == 0 ? begun_ : 0;
    std::copy(frames_[i].bytes.begin() + skipped, frames_[i].bytes.begin() + frames_[i].size,
              wire_.begin() + wire_size_);
    wire_size_ += frames_[i].size - skipped;
  }
}

}  // namespace kphi::iq
