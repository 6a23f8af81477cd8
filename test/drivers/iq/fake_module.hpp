// A module for tests: its own frames, CRC and parser, written from the manual without the driver's code.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace kphi::iq::fake {

using Bytes = std::vector<std::uint8_t>;
using Key = std::pair<int, int>;  // type, sub

inline std::uint16_t crc16(const std::uint8_t* bytes, std::size_t n) {
  std::uint16_t crc = 0xFFFF;
  for (std::size_t i = 0; i < n; ++i) {
    crc = static_cast<std::uint16_t>(crc ^ bytes[i] << 8);
    for (int bit = 0; bit < 8; ++bit) {
      crc = static_cast<std::uint16_t>((crc & 0x8000) != 0 ? crc << 1 ^ 0x1021 : crc << 1);
    }
  }
  return crc;
}

inline Bytes frame(int type, const Bytes& payload) {
  Bytes out{0x55, static_cast<std::uint8_t>(payload.size()), static_cast<std::uint8_t>(type)};
  out.insert(out.end(), payload.begin(), payload.end());
  const std::uint16_t crc = crc16(out.data() + 1, out.size() - 1);
  out.push_back(static_cast<std::uint8_t>(crc));
  out.push_back(static_cast<std::uint8_t>(crc >> 8));
  return out;
}

inline Bytes message(int type, int sub, int access, int id, const Bytes& data = {}) {
  Bytes payload{static_cast<std::uint8_t>(sub), static_cast<std::uint8_t>(id * 4 + access)};
  payload.insert(payload.end(), data.begin(), data.end());
  return frame(type, payload);
}

inline Bytes u8(int value) { return {static_cast<std::uint8_t>(value)}; }
inline Bytes u16(int value) { return {static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8)}; }
inline Bytes u32(std::uint32_t value) {
  return {static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8),
          static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>(value >> 24)};
}
inline Bytes f32(double value) { return u32(std::bit_cast<std::uint32_t>(static_cast<float>(value))); }
inline float to_f32(const Bytes& data) {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < 4; ++i) bits |= static_cast<std::uint32_t>(data.at(i)) << (8 * i);
  return std::bit_cast<float>(bits);
}

inline std::string hex(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    constexpr char digits[] = "0123456789ABCDEF";
    if (!text.empty()) text += ' ';
    text += digits[byte >> 4];
    text += digits[byte & 15];
  }
  return text;
}

struct QueryResult {
  int type = 0, sub = 0, access = 0, id = 0;
  Bytes data;
  [[nodiscard]] bool is_coast() const { return type == 52 && sub == 2 && access == 1; }
  [[nodiscard]] bool is_speed() const { return type == 52 && sub == 5 && access == 1; }
  [[nodiscard]] bool is_motion() const { return type == 52 && access == 1 && sub >= 1 && sub <= 6; }
};

/// Answers gets from a table, obeys sets, keeps a list of all it heard.
class Module {
 public:
  int id = 0;
  bool mute = false;            ///< hears, but answers nothing
  bool ignore_sets = false;     ///< as if they were lost
  std::set<Key> silent;         ///< entries this firmware lacks
  std::set<Key> read_only;      ///< entries that a set does not change
  std::map<Key, Bytes> values;  ///< what a get brings
  std::vector<QueryResult> heard;
  bool old_system_control = false;  ///< system_control answers on id 0 only
  unsigned baud = 0;                ///< 0: any
  int restarts = 0;
  bool turns_at_once = true;  ///< it has the commanded speed at once; else the test says how fast it turns

  using Clock = std::function<Duration()>;
  /// `now`: of its uptime.
  explicit Module(Clock now = [] { return Duration(std::chrono::steady_clock::now().time_since_epoch()); })
      : now_(std::move(now)), uptime_since_(now_()) {
    values = {{{50, 0}, u8(5)},          {{50, 13}, f32(0)},      {{69, 0}, f32(12.5)},      {{69, 1}, f32(3.25)},
              {{50, 36}, f32(10)},       {{83, 0}, f32(55.25)},   {{77, 0}, f32(44.5)},      {{50, 41}, u32(65536)},
              {{52, 15}, f32(1)},        {{52, 18}, u8(2)},       {{52, 19}, u8(2)},         {{5, 16}, u32(0x00100020)},
              {{5, 17}, u32(0x10100)},   {{5, 18}, u32(0x30000)}, {{5, 4}, u32(0x11111111)}, {{5, 5}, u32(0x22222222)},
              {{5, 6}, u32(0x33333333)}, {{5, 14}, u8(0)},        {{5, 15}, f32(100)},       {{84, 1}, u8(0)},
              {{50, 14}, u16(7)},        {{50, 32}, f32(2200)},   {{84, 0}, u8(0)},          {{52, 0}, u8(1)},
              {{52, 7}, f32(0.001)},     {{52, 8}, f32(0)},       {{52, 9}, f32(0)},         {{50, 33}, f32(0.045)},
              {{50, 8}, f32(0.5)}};
    silent = {{77, 0}};
  }

  /// As after a brown-out: what was set is lost, the uptime begins again.
  void restart() {
    const auto id_value = values[{5, 14}];
    values = Module(now_).values;
    values[{5, 14}] = id_value;
    values[{5, 15}] = f32(0.25);
    uptime_since_ = now_();
    ++restarts;
  }

  /// Bytes from the host in, replies out, in order, one element each.
  std::vector<Bytes> receive(std::span<const std::uint8_t> bytes) {
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    std::vector<Bytes> replies;
    std::size_t at = 0;
    while (at < buffer_.size()) {
      const std::size_t left = buffer_.size() - at;
      const std::size_t length = left > 1 ? buffer_[at + 1] : 0;
      if (buffer_[at] != 0x55 || length > 59) {
        ++at;
        continue;
      }
      if (left < length + 5) break;
      const std::uint16_t crc = crc16(&buffer_[at + 1], length + 2);
      const bool good = buffer_[at + length + 3] == (crc & 0xFF) && buffer_[at + length + 4] == crc >> 8;
      if (good && length >= 2) act(&buffer_[at], length, replies);
      at += good ? length + 5 : 1;
    }
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(at));
    return replies;
  }

  [[nodiscard]] const QueryResult* last_motion() const {
    for (auto it = heard.rbegin(); it != heard.rend(); ++it) {
      if (it->is_motion()) return &*it;
    }
    return nullptr;
  }
  [[nodiscard]] std::size_t count(const std::function<bool(const QueryResult&)>& what) const {
    std::size_t n = 0;
    for (const QueryResult& message : heard) n += what(message) ? 1 : 0;
    return n;
  }

 private:
  void act(const std::uint8_t* bytes, std::size_t length, std::vector<Bytes>& replies) {
    QueryResult message{bytes[2], bytes[3], bytes[4] & 3, bytes[4] >> 2, Bytes(bytes + 5, bytes + 3 + length)};
    heard.push_back(message);
    const bool for_system = message.type == 5 && old_system_control;
    const bool broadcast = message.id == 63 && message.access == 1;
    if (!broadcast && message.id != (for_system ? 0 : id)) return;
    const Key key{message.type, message.sub};
    if (message.access == 0 && !mute && silent.count(key) == 0 && values.count(key) != 0) {
      replies.push_back(frame_of_reply(message));
    }
    if (message.access == 1 && !ignore_sets && read_only.count(key) == 0) apply(message, key);
  }

  [[nodiscard]] Bytes frame_of_reply(const QueryResult& message) const {
    const Bytes& value = values.at({message.type, message.sub});
    const bool uptime = message.type == 5 && message.sub == 15;
    return kphi::iq::fake::message(message.type, message.sub, 3, message.id,
                                   uptime ? f32(to_f32(value) + to_seconds(now_() - uptime_since_)) : value);
  }

  void apply(const QueryResult& message, const Key& key) {
    if (key == Key{5, 0}) {
      restart();
    } else if (message.is_coast()) {
      values[{50, 0}] = u8(5);
      if (turns_at_once) values[{50, 13}] = f32(0);
    } else if (message.is_speed()) {
      values[{50, 0}] = u8(3);
      if (turns_at_once) values[{50, 13}] = message.data;
    } else if (values.count(key) != 0) {
      values[key] = message.data;
      if (key == Key{5, 15}) uptime_since_ = now_();
    }
  }

  Bytes buffer_;
  Clock now_;
  Duration uptime_since_;  ///< when it had the uptime of `values`
};

}  // namespace kphi::iq::fake
