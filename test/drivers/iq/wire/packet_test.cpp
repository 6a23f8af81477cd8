#include "drivers/iq/wire/packet.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "test/drivers/iq/fake_module.hpp"

namespace kphi::iq {
namespace packet_test {

using fake::Bytes;

Bytes encoded(const Packet& packet) {
  std::array<std::uint8_t, kMaxFrame> frame;
  return Bytes(frame.begin(), frame.begin() + encode(packet, frame));
}

struct Reception {
  Parser parser;
  std::vector<Bytes> frames;
  void push(std::span<const std::uint8_t> bytes) {
    parser.push(bytes, [&](const Packet& packet, std::uint64_t) { frames.push_back(encoded(packet)); });
  }
  void abandon() {
    parser.abandon([&](const Packet& packet, std::uint64_t) { frames.push_back(encoded(packet)); });
  }
};

/// Brute force over a whole recording: what a receiver that rewinds after each failure must find, and where it stands.
std::vector<std::pair<std::size_t, std::span<const std::uint8_t>>> all_frames(std::span<const std::uint8_t> bytes) {
  std::vector<std::pair<std::size_t, std::span<const std::uint8_t>>> found;
  for (std::size_t at = 0; at + 1 < bytes.size();) {
    const std::size_t size = bytes[at + 1] + 5u;
    if (bytes[at] != 0x55 || size > 64) {
      ++at;
      continue;
    }
    if (at + size > bytes.size()) break;
    const std::uint16_t crc = fake::crc16(&bytes[at + 1], size - 3);
    if (bytes[at + size - 2] == (crc & 0xFF) && bytes[at + size - 1] == crc >> 8) {
      found.emplace_back(at, bytes.subspan(at, size));
      at += size;
    } else {
      ++at;
    }
  }
  return found;
}

Bytes speed_reply(double value) { return fake::message(50, 13, 3, 0, fake::f32(value)); }

void append(Bytes& to, const Bytes& what) { to.insert(to.end(), what.begin(), what.end()); }

Bytes random_stream(std::mt19937& random, std::size_t size) {
  Bytes stream;
  while (stream.size() < size) {
    switch (random() % 4) {
      case 0:
        for (std::size_t i = random() % 40; i > 0; --i) stream.push_back(static_cast<std::uint8_t>(random()));
        break;
      case 1: {
        const std::uint8_t headers[] = {0x55, 0x55, 0x06, 0x3B, 0x3C, 0xFF, 0x00};
        for (std::size_t i = random() % 4; i > 0; --i) stream.push_back(headers[random() % 7]);
        break;
      }
      case 2: {
        Bytes payload(random() % 60);
        for (auto& byte : payload) byte = random() % 3 == 0 ? 0x55 : static_cast<std::uint8_t>(random());
        Bytes whole = fake::frame(static_cast<int>(random() % 256), payload);
        if (random() % 4 == 0) whole[random() % whole.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
        if (random() % 8 == 0) whole.resize(random() % whole.size());
        append(stream, whole);
        break;
      }
      default:
        append(stream, speed_reply(static_cast<double>(random() % 2000)));
    }
  }
  return stream;
}

TEST(Checksum, IsCrc16CcittFalse) {
  const auto of = [](const std::string& text) {
    return checksum({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  };
  EXPECT_EQ(of("123456789"), 0x29B1);
  EXPECT_EQ(of(""), 0xFFFF);
  EXPECT_EQ(of("\x01"), 0xF1D1);
  EXPECT_EQ(of("\x01\x02"), 0x0E7C);
  EXPECT_EQ(of("\x01\x02\x03"), 0xADAD);
}

TEST(Packet, RoundTripsForEveryTypeAndLength) {
  std::mt19937 random(1);
  for (int type = 0; type < 256; ++type) {
    for (std::size_t length = 0; length <= kMaxPayload; ++length) {
      Packet packet;
      packet.type = static_cast<std::uint8_t>(type);
      packet.length = static_cast<std::uint8_t>(length);
      for (std::size_t i = 0; i < length; ++i) packet.payload[i] = static_cast<std::uint8_t>(random());
      std::vector<Packet> received;
      Parser parser;
      parser.push(encoded(packet), [&](const Packet& p, std::uint64_t) { received.push_back(p); });
      ASSERT_EQ(received.size(), 1u);
      ASSERT_TRUE(received[0] == packet);
    }
  }
}

/// Frames of a stream, and where they end, in one number.
class Digest {
 public:
  void add(std::span<const std::uint8_t> frame, std::uint64_t end) {
    for (const std::uint8_t byte : frame) fold(byte);
    fold(end);
    ++count_;
  }
  friend bool operator==(const Digest&, const Digest&) = default;
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  void fold(std::uint64_t value) { hash_ = (hash_ ^ value) * 0x100000001B3; }
  std::uint64_t hash_ = 0xCBF29CE484222325;
  std::size_t count_ = 0;
};

Digest brute_force(std::span<const std::uint8_t> bytes) {
  Digest digest;
  for (const auto& [begin, frame] : all_frames(bytes)) digest.add(frame, begin + frame.size());
  return digest;
}

Digest parsed(std::span<const std::uint8_t> bytes, std::size_t chunk) {
  Digest digest;
  Parser parser;
  for (std::size_t at = 0; at < bytes.size(); at += chunk) {
    parser.push(bytes.subspan(at, std::min(chunk, bytes.size() - at)), [&](const Packet& packet, std::uint64_t end) {
      std::array<std::uint8_t, kMaxFrame> frame;
      digest.add(std::span(frame).first(encode(packet, frame)), end);
    });
  }
  return digest;
}

std::vector<std::size_t> chunk_sizes(std::mt19937& random) {
  std::vector<std::size_t> sizes(64);
  std::iota(sizes.begin(), sizes.end(), std::size_t{1});
  for (int i = 0; i < 32; ++i) sizes.push_back(65 + random() % 4031);
  sizes.push_back(4096);
  return sizes;
}

#ifdef KPHI_SANITIZED
constexpr std::size_t kManyBytes = 500'000;
#else
constexpr std::size_t kManyBytes = 10'000'000;
#endif

// Each chunk size reads one quarter of the bytes; the brute force reads each quarter once.
TEST(Parser, FindsWhatABruteForceScannerFindsInTenMillionBytesForEveryChunkSize) {
  std::mt19937 random(20210530);
  const Bytes stream = random_stream(random, kManyBytes);
  const std::size_t quarter = stream.size() / 4;
  std::array<std::span<const std::uint8_t>, 4> parts;
  std::array<Digest, 4> expected;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    parts[i] = std::span(stream).subspan(i * quarter, quarter);
    expected[i] = brute_force(parts[i]);
    ASSERT_GT(expected[i].count(), kManyBytes / 250);
  }
  std::size_t turn = 0;
  for (const std::size_t chunk : chunk_sizes(random)) {
    const std::size_t part = turn++ % parts.size();
    ASSERT_EQ(parsed(parts[part], chunk), expected[part]) << "chunks of " << chunk << ", quarter " << part;
  }
}

TEST(Parser, FindsWhatABruteForceScannerFindsInPureNoise) {
  std::mt19937 random(1);
  Bytes noise(kManyBytes / 5);
  for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
  EXPECT_EQ(parsed(noise, 4096), brute_force(noise));
  EXPECT_EQ(parsed(noise, 1), brute_force(noise));
}

TEST(Parser, FindsWhatABruteForceScannerFindsBehindEveryTruncation) {
  const Bytes cut = fake::message(50, 13, 3, 0, {0x55, 0x3B, 0x55, 0x06});
  for (std::size_t size = 0; size <= cut.size(); ++size) {
    for (std::size_t good = 0; good < 8; ++good) {
      Bytes stream(cut.begin(), cut.begin() + static_cast<std::ptrdiff_t>(size));
      for (std::size_t i = 0; i < good; ++i) append(stream, speed_reply(static_cast<double>(i)));
      for (const std::size_t chunk : {1u, 5u, 64u}) ASSERT_EQ(parsed(stream, chunk), brute_force(stream)) << size;
    }
  }
}

TEST(Parser, AccountsForEveryByte) {
  std::mt19937 random(7);
  const Bytes stream = random_stream(random, 200'000);
  Reception reception;
  reception.push(stream);
  while (reception.parser.partial()) reception.abandon();
  std::size_t in_packets = 0;
  for (const Bytes& frame : reception.frames) in_packets += frame.size();
  const Parser::Counters& counters = reception.parser.counters();
  EXPECT_EQ(counters.bytes_in, stream.size());
  EXPECT_EQ(counters.packets, reception.frames.size());
  EXPECT_EQ(counters.discarded_bytes, stream.size() - in_packets);
}

TEST(Parser, TellsWhereAPacketEnds) {
  Bytes stream{0x55, 0x1E, 0x32};
  append(stream, speed_reply(1));
  append(stream, speed_reply(2));
  append(stream, {0x55, 0x06});
  std::vector<std::uint64_t> ends;
  Parser parser;
  const auto note = [&](const Packet&, std::uint64_t end) { ends.push_back(end); };
  parser.push(std::span(stream).first(5), note);
  parser.push(std::span(stream).subspan(5), note);
  EXPECT_TRUE(ends.empty());
  parser.abandon(note);
  EXPECT_EQ(ends, (std::vector<std::uint64_t>{14, 25}));
}

TEST(Parser, LosesNothingBetweenNoise) {
  std::mt19937 random(3);
  Bytes stream;
  for (int i = 0; i < 2000; ++i) {
    for (std::size_t n = random() % 8; n > 0; --n) {
      const auto byte = static_cast<std::uint8_t>(random());
      stream.push_back(byte == 0x55 ? 0x54 : byte);  // a false header may rightly wait for more
    }
    append(stream, speed_reply(i));
  }
  for (const std::size_t chunk : {1u, 16u, 32u, 60u, 4096u}) {
    Reception reception;
    for (std::size_t at = 0; at < stream.size(); at += chunk) {
      reception.push(std::span(stream).subspan(at, std::min<std::size_t>(chunk, stream.size() - at)));
    }
    EXPECT_EQ(reception.frames.size(), 2000u) << "chunks of " << chunk;
  }
}

TEST(Parser, DeliversTheGoodPacketBehindABadCrc) {
  Bytes stream = speed_reply(1);
  stream[6] ^= 1;
  append(stream, speed_reply(2));
  Reception reception;
  reception.push(stream);
  ASSERT_EQ(reception.frames.size(), 1u);
  EXPECT_EQ(reception.frames[0], speed_reply(2));
  EXPECT_EQ(reception.parser.counters().crc_errors, 1u);
}

TEST(Parser, DeliversBehindStrayStartsGarbageTruncationAndRefusedLengths) {
  const Bytes good = speed_reply(2);
  const std::vector<Bytes> before = {
      {},           {0x55},      {0x55, 0x55, 0x55}, {0x00, 0xFF, 0x12}, Bytes(good.begin(), good.begin() + 6),
      {0x55, 0xFF}, {0x55, 0x3C}};
  for (const Bytes& noise : before) {
    Bytes stream = noise;
    append(stream, good);
    append(stream, good);
    Reception reception;
    reception.push(stream);
    EXPECT_EQ(reception.frames.size(), 2u) << fake::hex(noise);
    if (noise != Bytes{0x55, 0xFF}) continue;
    EXPECT_EQ(reception.parser.counters().refused_lengths, 1u) << fake::hex(noise);
  }
}

TEST(Parser, AbandoningAFalseHeaderBringsOutWhatItWithheld) {
  for (const std::uint8_t length : {0x0A, 0x1E, 0x3B}) {
    Bytes stream{0x55, length, 0x32};
    append(stream, speed_reply(2));
    Reception reception;
    reception.push(stream);
    if (length != 0x0A) {
      ASSERT_EQ(reception.frames.size(), 0u);
      ASSERT_TRUE(reception.parser.partial());
      EXPECT_EQ(reception.parser.partial_offset(), 0u);
    }
    reception.abandon();
    ASSERT_EQ(reception.frames.size(), 1u) << int{length};
    EXPECT_FALSE(reception.parser.partial());
  }
}

TEST(Parser, AbandoningKeepsAYoungerFrameThatIsStillComing) {
  const Bytes coming = speed_reply(3);
  Bytes stream{0x55, 0x3B, 0x32};
  append(stream, speed_reply(2));
  append(stream, Bytes(coming.begin(), coming.begin() + 5));
  Reception reception;
  reception.push(stream);
  reception.abandon();
  ASSERT_EQ(reception.frames.size(), 1u);
  reception.push(std::span(coming).subspan(5));
  ASSERT_EQ(reception.frames.size(), 2u);
  EXPECT_EQ(reception.frames[1], coming);
}

}  // namespace packet_test
}  // namespace kphi::iq
