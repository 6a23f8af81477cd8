#include "drivers/iq/wire/entries.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <sstream>

#include "test/drivers/iq/fake_module.hpp"
#include "test/source_dir.hpp"

namespace kphi::iq {
namespace entries_test {

using fake::Bytes;

static_assert(!Known<"brushless_drive.obs_supply_amps">, "there is no such entry");
static_assert(entry<"power_safety.fault_now">.format == Format::u8, "one byte; the vendor's C++ says float");
static_assert(entry<"propeller_motor_control.ctrl_mode">.format == Format::i8);

struct Vector {
  std::string op, type, sub, id, name, format, value;
  Bytes frame;
};

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  for (std::size_t at = 0;;) {
    const std::size_t bar = line.find(" | ", at);
    fields.push_back(line.substr(at, bar - at));
    if (bar == std::string::npos) return fields;
    at = bar + 3;
  }
}

Bytes bytes_of(const std::string& text) {
  Bytes bytes;
  std::istringstream in(text);
  for (std::string byte; in >> byte;) bytes.push_back(static_cast<std::uint8_t>(std::stoul(byte, nullptr, 16)));
  return bytes;
}

std::vector<Vector> golden() {
  std::ifstream file(kphi::test::source_dir() + "/test/golden/iq_frames.txt");
  std::vector<Vector> vectors;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    const auto f = fields_of(line);
    vectors.push_back({f.at(2), f.at(3), f.at(4), f.at(5), f.at(6), f.at(7), f.at(8), bytes_of(f.at(9))});
  }
  return vectors;
}

Access access_of(const std::string& op) {
  return op == "get" ? Access::get : op == "set" ? Access::set : op == "save" ? Access::save : Access::reply;
}

Format format_of(const std::string& text) {
  constexpr std::pair<char, Format> kLetters[] = {{'f', Format::f32}, {'b', Format::i8},  {'B', Format::u8},
                                                  {'H', Format::u16}, {'I', Format::u32}, {'i', Format::i32}};
  for (const auto& [letter, format] : kLetters)
    if (text.at(0) == letter) return format;
  return Format::none;
}

Bytes encoded(const Packet& packet) {
  std::array<std::uint8_t, kMaxFrame> frame;
  return Bytes(frame.begin(), frame.begin() + encode(packet, frame));
}

Packet decoded(const Bytes& frame) {
  Packet result;
  int packets = 0;
  Parser parser;
  parser.push(frame, [&](const Packet& packet, std::uint64_t) {
    result = packet;
    ++packets;
  });
  EXPECT_EQ(packets, 1) << fake::hex(frame);
  EXPECT_FALSE(parser.partial());
  return result;
}

TEST(GoldenFrames, AreSeventyTwo) { EXPECT_EQ(golden().size(), 72u); }

TEST(GoldenFrames, EncodeByteForByte) {
  for (const Vector& vector : golden()) {
    const Entry* found = find(vector.name);
    if (found == nullptr) {  // no payload of an entry that kphi uses
      const Packet packet = decoded(vector.frame);
      EXPECT_EQ(encoded(packet), vector.frame);
      continue;
    }
    EXPECT_TRUE(found->allows(access_of(vector.op))) << vector.name << ' ' << vector.op;
    const double value = vector.value == "-" ? 0 : std::stod(vector.value);
    EXPECT_EQ(fake::hex(encoded(make(*found, access_of(vector.op), std::stoi(vector.id), value))),
              fake::hex(vector.frame))
        << vector.name;
  }
}

TEST(GoldenFrames, DecodeToTheirFields) {
  for (const Vector& vector : golden()) {
    const Packet packet = decoded(vector.frame);
    EXPECT_EQ(packet.type, std::stoi(vector.type));
    if (vector.op == "raw") continue;
    ASSERT_TRUE(packet.standard());
    EXPECT_EQ(packet.sub(), std::stoi(vector.sub));
    EXPECT_EQ(packet.module_id(), std::stoi(vector.id));
    EXPECT_EQ(packet.access(), access_of(vector.op));
    const Entry* found = find(vector.name);
    if (found == nullptr) continue;
    EXPECT_EQ(static_cast<int>(found->type), packet.type);
    EXPECT_EQ(found->sub, packet.sub());
    EXPECT_EQ(found->format, format_of(vector.format)) << vector.name;
    if (vector.value == "-") continue;
    ASSERT_EQ(packet.data().size(), size_of(found->format));
    const double value = number(found->format, packet.data());
    if (vector.value.substr(0, 3) == "nan") {
      EXPECT_TRUE(std::isnan(value));
    } else if (found->format == Format::f32) {
      EXPECT_EQ(static_cast<float>(value), std::stof(vector.value)) << vector.name;
    } else {
      EXPECT_EQ(value, std::stod(vector.value)) << vector.name;
    }
  }
}

TEST(GoldenFrames, FurtherOnesFollowTheSameRules) {
  const auto hex = [](const Packet& packet) { return fake::hex(encoded(packet)); };
  constexpr int kAll = 63;
  EXPECT_EQ(hex(make(entry<"propeller_motor_control.ctrl_coast">, Access::set, kAll)), "55 02 34 02 FD 1D 28");
  EXPECT_EQ(hex(make(entry<"system_control.module_id">, Access::get, kAll)), "55 02 05 0E FC C4 8F");
  EXPECT_EQ(hex(make(entry<"system_control.firmware_version">, Access::reply, 0, 0x00100020)),
            "55 06 05 10 03 20 00 10 00 39 08");
  EXPECT_EQ(hex(make(entry<"system_control.hardware_version">, Access::reply, 0, 0x00010100)),
            "55 06 05 11 03 00 01 01 00 A5 7D");
  EXPECT_EQ(hex(make(entry<"system_control.electronics_version">, Access::reply, 0, 0x00030000)),
            "55 06 05 12 03 00 00 03 00 17 E2");
  EXPECT_EQ(hex(make(entry<"coil_temperature_estimator.derate">, Access::get, 0)), "55 02 53 0A 00 FD 81");
  EXPECT_EQ(hex(make(entry<"power_safety.fault_ever">, Access::get, 0)), "55 02 54 01 00 97 D8");
  EXPECT_EQ(hex(make(entry<"power_safety.fault_ever">, Access::set, 0)), "55 03 54 01 01 00 15 44");
  EXPECT_EQ(hex(make(entry<"propeller_motor_control.timeout_behavior">, Access::set, 0)), "55 03 34 12 01 00 F4 07");
  EXPECT_EQ(hex(make(entry<"propeller_motor_control.timeout_song_option">, Access::set, 0)), "55 03 34 13 01 00 C4 30");
  EXPECT_EQ(fake::hex(encoded(decoded(bytes_of("55 05 58 00 FD 00 00 00 74 53")))), "55 05 58 00 FD 00 00 00 74 53");
  EXPECT_EQ(decoded(bytes_of("55 0B 58 00 FD 00 00 90 65 00 80 FF FF 05 5F 6F")).module_id(), kAll);
}

TEST(EntryTable, NamesEveryEntryOnce) {
  std::set<std::pair<int, int>> keys;
  std::set<std::string_view> paths;
  std::map<Client, std::string_view> clients;
  for (const Entry& row : kEntries) {
    EXPECT_TRUE(keys.insert({static_cast<int>(row.type), row.sub}).second) << row.path;
    EXPECT_TRUE(paths.insert(row.path).second) << row.path;
    const std::string_view client = row.path.substr(0, row.path.find('.'));
    EXPECT_EQ(clients.emplace(row.type, client).first->second, client) << row.path;
    EXPECT_EQ(find(row.path), &row);
  }
  EXPECT_EQ(std::size(kEntries), 80u);
}

TEST(EntryTable, CommandsWithoutDataCanOnlyBeSet) {
  for (const Entry& row : kEntries) {
    EXPECT_TRUE(row.format != Format::none || row.permitted == kSet) << row.path;
  }
}

TEST(Numbers, SurviveTheirFormatWithTheirBits) {
  const Entry& velocity = entry<"propeller_motor_control.ctrl_velocity">;
  for (const std::uint32_t bits : {0x00000000u, 0x80000000u, 0x00000001u, 0x3406CA6Bu, 0x7F7FFFFFu, 0xFF800000u}) {
    const float value = std::bit_cast<float>(bits);
    const Packet packet = make(velocity, Access::set, 0, value);
    EXPECT_EQ(Bytes(packet.data().begin(), packet.data().end()), fake::u32(bits));
    EXPECT_EQ(std::bit_cast<std::uint32_t>(static_cast<float>(number(Format::f32, packet.data()))), bits);
  }
  for (const double value : {0.0, 1.0, 255.0, 921600.0, 4294967295.0}) {
    EXPECT_EQ(number(Format::u32, make(entry<"power_monitor.filter_fc">, Access::set, 0, value).data()), value);
  }
}

TEST(Numbers, AreHeldToTheRangeOfIntegers) {
  const Entry& byte = entry<"propeller_motor_control.timeout_behavior">;
  const auto through = [&](double value) { return number(Format::u8, make(byte, Access::set, 0, value).data()); };
  EXPECT_EQ(through(-1), 0);
  EXPECT_EQ(through(256), 255);
  EXPECT_EQ(through(1.6), 2);
  EXPECT_EQ(through(std::numeric_limits<double>::quiet_NaN()), 0);
}

TEST(Numbers, OfTheWrongLengthAreNone) {
  const Bytes two{1, 2};
  EXPECT_TRUE(std::isnan(number(Format::f32, two)));
  EXPECT_TRUE(std::isnan(number(Format::u8, two)));
  EXPECT_EQ(number(Format::u16, two), 0x0201);
}

TEST(ReadBack, IsComparedBitByBit) {
  constexpr const Entry& kFf2 = entry<"propeller_motor_control.velocity_ff2">;
  constexpr const Entry& kTimeout = entry<"propeller_motor_control.timeout">;
  EXPECT_TRUE(is_as_set(kFf2, 5e-7, static_cast<float>(5e-7)));
  EXPECT_FALSE(is_as_set(kFf2, 5e-7, 5e-7 * (1 + 0.9e-6)));
  EXPECT_FALSE(is_as_set(kFf2, 5e-7, 5.1e-7)) << "2 % off, and only 1e-8 away";
  EXPECT_FALSE(is_as_set(kFf2, 5e-7, 0));
  EXPECT_FALSE(is_as_set(kFf2, 0, 1e-30));
  EXPECT_TRUE(is_as_set(kFf2, 0, -0.0));
  EXPECT_FALSE(is_as_set(kFf2, 5e-7, std::nan("")));
  EXPECT_TRUE(is_as_set(kTimeout, 0.5, 0.5));
  EXPECT_FALSE(is_as_set(entry<"hobby_input.allowed_protocols">, 254, 255));
}

}  // namespace entries_test
}  // namespace kphi::iq
