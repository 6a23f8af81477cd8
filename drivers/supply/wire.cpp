#include "drivers/supply/wire.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <boost/crc.hpp>
#include <cmath>
#include <iterator>

#include "base/number.hpp"

namespace kphi::supply {
namespace {

constexpr unsigned kBauds[] = {1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600};
constexpr unsigned kMostLooks = 20;
constexpr const char* kForms =
    "write modbus-rtu:/dev/ttyUSB0?baud=115200&slave=1 or modbus-tcp:192.168.1.20:502?slave=1";

void set_option(Address& address, const Uri& uri, const std::string& key, const std::string& value) {
  const auto number = parse_integer<unsigned>(value);
  const bool rtu = address.wire == Address::Wire::rtu;
  if (key == "baud" && rtu) {
    if (!number || !known_baud(*number))
      uri.refuse(fmt::format("\"{}\" is not a baud rate that can be set", value),
                 fmt::format("use one of {}", fmt::join(kBauds, ", ")));
    address.baud = *number;
  } else if (key == "slave") {
    const bool unit_of_tcp = !rtu && number == 255u;
    if (!number || ((*number < 1 || *number > 247) && !unit_of_tcp))
      uri.refuse(fmt::format("slave \"{}\" is not a Modbus address", value), "use 1 to 247; the default is 1");
    address.slave = static_cast<int>(*number);
  } else if (key == "model") {
    if (find_model(value) == nullptr)
      uri.refuse(fmt::format("unknown model \"{}\"", value),
                 fmt::format("use one of {}", fmt::join(model_names(), ", ")));
    address.model = value;
  } else if (key == "looks") {
    if (!number || *number < 1 || *number > kMostLooks)
      uri.refuse(fmt::format("looks={} is out of range", value),
                 fmt::format("use 1 to {}; the default is {}", kMostLooks, Address{}.looks));
    address.looks = *number;
  } else {
    uri.refuse(fmt::format("unknown option \"{}\"", key),
               rtu ? "use baud, slave, model or looks" : "use slave, model or looks");
  }
}

}  // namespace

std::string Address::where() const { return wire == Wire::rtu ? device : tcp.text(); }

bool known_baud(unsigned baud) noexcept { return std::ranges::find(kBauds, baud) != std::end(kBauds); }

Address parse_address(const std::string& text) {
  const Uri uri(text, "supply", kForms);
  Address address;
  address.uri = text;
  if (uri.scheme() == "modbus-rtu") {
    if (uri.location().size() < 2 || uri.location().front() != '/') uri.refuse("the device is not an absolute path");
    address.device = uri.location();
  } else if (uri.scheme() == "modbus-tcp") {
    address.wire = Address::Wire::tcp;
    address.tcp = uri.host_and_port(502);
  } else {
    uri.refuse(fmt::format("unknown scheme \"{}:\"", uri.scheme()));
  }
  for (const auto& [key, value] : uri.options()) set_option(address, uri, key, value);
  if (address.wire == Address::Wire::rtu && address.baud == 0)
    address.baud = address.model.empty() ? 115200 : find_model(address.model)->map->usual_baud;
  return address;
}

namespace {

// "riden-dongle" says that what is read from 82 and 83 is not reliable after a preset was recalled on the front panel.
constexpr RegisterMap kRiden{
    .family = "RD60xx",
    .usual_baud = 115200,
    .identity = {0, 4},
    .model = 0,
    .serial = 1,
    .firmware = 3,
    .look = {Block{8, 13}},
    .set_voltage = 8,
    .current_limit = 9,
    .voltage = 10,
    .current = 11,
    .protection = 16,
    .regulation = 17,
    .output = 18,
    .current_range = 20,
    .thresholds = {82, 2},
    .over_voltage = 82,
    .over_current = 83,
    .keypad = 15,
};

// RuiDeng DPH5005 manual, p. 11.
constexpr RegisterMap kDps{
    .family = "DPS/DPH",
    .usual_baud = 9600,
    .identity = {0x0B, 2},
    .model = 0x0B,
    .firmware = 0x0C,
    .look = {Block{0, 10}},
    .set_voltage = 0,
    .current_limit = 1,
    .voltage = 2,
    .current = 3,
    .protection = 7,
    .regulation = 8,
    .output = 9,
    .thresholds = {0x50, 4},
    .over_voltage = 0x52,
    .over_current = 0x53,
};

// It has no register for the regulation, and its paper promises functions 03 and 06 only.
constexpr RegisterMap kHanmatek{
    .family = "HM3xx",
    .usual_baud = 9600,
    .write_multiple = false,
    .identity = {0x01, 5},
    .model = 0x03,
    .decimals = 0x05,
    .look = {Block{0x01, 2}, Block{0x10, 2}, Block{0x30, 2}},
    .set_voltage = 0x30,
    .current_limit = 0x31,
    .voltage = 0x10,
    .current = 0x11,
    .protection = 0x02,
    .protection_bits = true,
    .output = 0x01,
    .thresholds = {0x20, 2},
    .over_voltage = 0x20,
    .over_current = 0x21,
};

constexpr CurrentRange kNone{};

/// nullptr when there is none.
const Model* first_model(auto&& fits) {
  const auto found = std::ranges::find_if(models(), fits);
  return found == models().end() ? nullptr : &*found;
}

std::string bytes_of(std::initializer_list<unsigned> values) {
  std::string bytes;
  for (const unsigned value : values) bytes.push_back(static_cast<char>(value));
  return bytes;
}

/// MODBUS over serial line, 6.2.2: the checksum's low byte first.
std::string on_serial(const std::string& frame) {
  boost::crc_optimal<16, 0x8005, 0xFFFF, 0, true, true> crc;
  crc.process_bytes(frame.data(), frame.size());
  return frame + bytes_of({crc.checksum() & 0xFFu, static_cast<unsigned>(crc.checksum()) >> 8u});
}

/// Transaction, Modbus, bytes that follow (MODBUS Messaging on TCP/IP, 3.1.3).
std::string on_tcp(unsigned transaction, const std::string& frame) {
  return bytes_of({0x4Bu, transaction, 0u, 0u, 0u, static_cast<unsigned>(frame.size())}) + frame;
}

}  // namespace

const std::vector<Model>& models() {
  // Hanmatek's over-current threshold: two decimals by the maker's list, three by another. Two trips too early at
  // worst.
  static const std::vector<Model> kModels{
      {"RD6006", 60060, 60064, &kRiden, 100, 60, {{{1000, 6}, kNone}}},
      {"RD6006P", 60065, 60065, &kRiden, 1000, 60, {{{10000, 6}, kNone}}},
      {"RD6012", 60120, 60124, &kRiden, 100, 60, {{{100, 12}, kNone}}},
      {"RD6012P", 60125, 60129, &kRiden, 1000, 60, {{{10000, 6}, {1000, 12}}}},
      {"RD6018", 60180, 60189, &kRiden, 100, 60, {{{100, 18}, kNone}}},
      {"RD6024", 60240, 60244, &kRiden, 100, 60, {{{100, 24}, kNone}}},
      {"RD6030", 60300, 60309, &kRiden, 100, 60, {{{100, 30}, kNone}}},
      {"DPS3005", 3005, 3005, &kDps, 100, 30, {{{1000, 5}, kNone}}},
      {"DPS5005", 5005, 5005, &kDps, 100, 50, {{{1000, 5}, kNone}}},
      {"DPH5005", 5205, 5205, &kDps, 100, 50, {{{1000, 5}, kNone}}},
      {"DPS5015", 5015, 5015, &kDps, 100, 50, {{{100, 15}, kNone}}},
      {"DPS5020", 5020, 5020, &kDps, 100, 50, {{{100, 20}, kNone}}},
      {"DPS8005", 8005, 8005, &kDps, 100, 80, {{{1000, 5}, kNone}}},
      {"HM305P", 305, 305, &kHanmatek, 100, 30, {{{1000, 5}, kNone}}, 100},
      {"HM310P", 3010, 3010, &kHanmatek, 100, 30, {{{1000, 10}, kNone}}, 100},
  };
  return kModels;
}

std::vector<std::string_view> model_names() {
  std::vector<std::string_view> names;
  for (const Model& model : models()) names.push_back(model.name);
  return names;
}

std::vector<const RegisterMap*> families() { return {&kRiden, &kDps, &kHanmatek}; }

const Model* find_model(std::string_view name) {
  return first_model([&](const Model& m) { return m.name == name; });
}

const Model* find_model(const RegisterMap& map, std::uint16_t id) {
  return first_model([&](const Model& m) { return m.map == &map && m.first_id <= id && id <= m.last_id; });
}

LastWord off_word(const Address& address, const RegisterMap& map, std::string device) {
  const unsigned at = static_cast<std::uint16_t>(map.output), slave = static_cast<unsigned>(address.slave);
  const std::string order = bytes_of({slave, 0x06u, at >> 8u, at & 0xFFu, 0u, 0u});
  const std::string question = bytes_of({slave, 0x03u, at >> 8u, at & 0xFFu, 0u, 1u});
  const std::string is_off = bytes_of({slave, 0x03u, 2u, 0u, 0u});
  LastWord word{std::move(device), LastWord::Wire::serial, address.device, address.baud, on_serial(order), order};
  word.question = on_serial(question);
  word.proofs = {on_serial(is_off)};
  if (address.wire == Address::Wire::tcp) {
    word.wire = LastWord::Wire::tcp;
    word.where = address.tcp.host;
    word.number = address.tcp.port;
    word.bytes = on_tcp(1, order);
    word.question = on_tcp(2, question);
    word.proofs = {on_tcp(2, is_off)};
  }
  return word;
}

SupplyProtection protection_of(const RegisterMap& map, std::uint16_t code) noexcept {
  constexpr std::array kCauses{SupplyProtection::over_voltage, SupplyProtection::over_current,
                               SupplyProtection::over_power, SupplyProtection::over_temperature,
                               SupplyProtection::short_circuit};
  if (code == 0) return SupplyProtection::none;
  const std::size_t cause = map.protection_bits ? static_cast<std::size_t>(std::countr_zero(code)) : code - 1u;
  const std::size_t known = map.protection_bits ? kCauses.size() : 3;
  return cause < known ? kCauses[cause] : SupplyProtection::unknown;
}

std::uint16_t to_counts(double value, double counts_per_unit) noexcept {
  return static_cast<std::uint16_t>(std::llround(value * counts_per_unit));
}

bool fits(double value, double counts_per_unit, double max) noexcept {
  if (!std::isfinite(value) || !(value >= 0)) return false;
  const double most = std::min(std::round(max * counts_per_unit), 65535.0);
  return std::round(value * counts_per_unit) <= most;
}

}  // namespace kphi::supply
