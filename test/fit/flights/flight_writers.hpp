// Flight logs of known content, written byte by byte from the public descriptions of their formats; nothing is shared
// with the readers.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace kphi::test {

/// Little-endian, whatever this computer is.
class LogBytes {
 public:
  template <class Integer>
  LogBytes& whole(Integer value) {
    auto bits = static_cast<std::uint64_t>(value);
    for (std::size_t i = 0; i < sizeof(Integer); ++i, bits >>= 8) bytes += static_cast<char>(bits & 0xFF);
    return *this;
  }
  LogBytes& single(float value) {
    static_assert(sizeof(float) == 4);
    std::uint32_t bits = 0;
    const auto* from = reinterpret_cast<const unsigned char*>(&value);
    for (int i = 3; i >= 0; --i) bits = bits << 8 | from[i];
    return whole(bits);
  }
  LogBytes& text(std::string_view words) {
    bytes += words;
    return *this;
  }
  std::string bytes;
};

class UlogWriter {
 public:
  explicit UlogWriter(std::uint64_t start_us) {
    log_.text("ULog").whole<std::uint8_t>(0x01).whole<std::uint8_t>(0x12).whole<std::uint8_t>(0x35);
    log_.whole<std::uint8_t>(1).whole(start_us);
  }
  UlogWriter& message(char type, const std::string& payload) {
    log_.whole(static_cast<std::uint16_t>(payload.size())).text(std::string(1, type)).text(payload);
    return *this;
  }
  UlogWriter& flags(std::uint8_t incompatible = 0, std::uint64_t appended_at = 0) {
    LogBytes payload;
    payload.whole<std::uint64_t>(0).whole<std::uint64_t>(incompatible);
    payload.whole(appended_at).whole<std::uint64_t>(0).whole<std::uint64_t>(0);
    return message('B', payload.bytes);
  }
  UlogWriter& format(const std::string& text) { return message('F', text); }
  UlogWriter& subscribe(std::uint16_t id, const std::string& topic, std::uint8_t instance = 0) {
    return message('A', LogBytes().whole(instance).whole(id).text(topic).bytes);
  }
  UlogWriter& data(std::uint16_t id, const LogBytes& content) {
    return message('D', LogBytes().whole(id).text(content.bytes).bytes);
  }
  UlogWriter& dropout(std::uint16_t ms) { return message('O', LogBytes().whole(ms).bytes); }
  UlogWriter& sync() { return message('S', std::string("\x2F\x73\x13\x20\x25\x0C\xBB\x12", 8)); }
  UlogWriter& raw(const std::string& bytes) {
    log_.text(bytes);
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const { return log_.bytes; }

 private:
  LogBytes log_;
};

/// CRC-32 of IEEE 802.3, bit by bit.
inline std::uint32_t crc_32(std::string_view bytes) {
  std::uint32_t crc = 0xFFFFFFFFu;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xEDB88320u : 0);
  }
  return ~crc;
}

class CardLogWriter {
 public:
  struct Kind {
    std::uint16_t id = 0;
    std::string name;
    std::vector<std::string> variables;  ///< "acc.x(f)"
  };
  CardLogWriter(std::uint16_t version, const std::vector<Kind>& kinds) : version_(version) {
    log_.whole<std::uint8_t>(0xBC).whole(version).whole(static_cast<std::uint16_t>(kinds.size()));
    for (const Kind& kind : kinds) {
      log_.whole(kind.id).text(kind.name).whole<std::uint8_t>(0).whole(
          static_cast<std::uint16_t>(kind.variables.size()));
      for (const std::string& variable : kind.variables) log_.text(variable).whole<std::uint8_t>(0);
    }
  }
  CardLogWriter& record(std::uint16_t id, std::uint64_t time, const LogBytes& values) {
    log_.whole(id);
    version_ == 1 ? log_.whole(static_cast<std::uint32_t>(time)) : log_.whole(time);
    log_.text(values.bytes);
    return *this;
  }
  /// With its CRC.
  [[nodiscard]] std::string bytes() const { return LogBytes(log_).whole(crc_32(log_.bytes)).bytes; }

 private:
  std::uint16_t version_;
  LogBytes log_;
};

}  // namespace kphi::test
