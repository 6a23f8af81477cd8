#include "drivers/iq/packet.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <random>

#include "test/drivers/iq/fake_module.hpp"

namespace kphi::iq {
namespace {

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
std::vector<Bytes> all_frames(const Bytes& bytes) {
  std::vector<Bytes> found;
  for (std::size_t at = 0; at + 1 < bytes.size();) {
    const std::size_t size = bytes[at + 1] + 5u;
    if (bytes[at] != 0x55 || size > 64) {
      ++at;
      continue;
    }
    if (at + size > bytes.size()) break;
    const std::uint16_t crc = fake::crc16(&bytes[at + 1], size - 3);
    if (bytes[at + size - 2] == (crc & 0xFF) && bytes[at + size - 1] == crc >> 8) {
      found.emplace_back(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                         bytes.begin() + static_cast<std::ptrdiff_t>(at + size));
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

TEST(Parser, FindsWhatABruteForceScannerFindsForEveryChunkSize) {
  std::mt19937 random(20210530);
  const Bytes stream = random_stream(random, 1'100'000);
  const std::vector<Bytes> expected = all_frames(stream);
  ASSERT_GT(expected.size(), 20'000u);
  for (std::size_t chunk = 1; chunk <= 64; ++chunk) {
    Reception reception;
    for (std::size_t at = 0; at < stream.size(); at += chunk) {
      reception.push(std::span(stream).subspan(at, std::min(chunk, stream.size() - at)));
    }
    ASSERT_TRUE(reception.frames == expected)
        << "chunks of " << chunk << ": " << reception.frames.size() << " of " << expected.size();
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
  EXPECT_EQ(counters.bytes, stream.size());
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

TEST(Parser, TakesBurstsOfTwentyRepliesInOneRead) {
  Bytes stream;
  for (int i = 0; i < 20; ++i) append(stream, speed_reply(i));
  Reception reception;
  reception.push(stream);
  EXPECT_EQ(reception.frames.size(), 20u);
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

TEST(Parser, DeliversBehindStrayStartsGarbageAndTruncation) {
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
  }
}

TEST(Parser, RefusesALengthOverTheLimitAtOnce) {
  Bytes stream{0x55, 0xFF};
  append(stream, speed_reply(2));
  Reception reception;
  reception.push(stream);
  EXPECT_EQ(reception.frames.size(), 1u);
  EXPECT_EQ(reception.parser.counters().refused_lengths, 1u);
}

TEST(Parser, AbandoningAFalseHeaderBringsOutWhatItWithheld) {
  for (const std::uint8_t length : {0x0A, 0x1E, 0x3B}) {
    Bytes stream{0x55, length, 0x32};
    append(stream, speed_reply(2));
    Reception reception;
    if (length != 0x0A) {
      reception.push(stream);
      ASSERT_EQ(reception.frames.size(), 0u);
      ASSERT_TRUE(reception.parser.partial());
      EXPECT_EQ(reception.parser.partial_offset(), 0u);
      reception.abandon();
    } else {
      reception.push(stream);
      reception.abandon();
    }
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

TEST(Parser, CarriesANanWithItsBits) {
  const Bytes nan = fake::message(50, 13, 3, 0, {0x01, 0x00, 0xC0, 0x7F});
  Reception reception;
  reception.push(nan);
  ASSERT_EQ(reception.frames.size(), 1u);
  EXPECT_EQ(reception.frames[0], nan);
}

}  // namespace
}  // namespace kphi::iq
