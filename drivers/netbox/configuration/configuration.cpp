#include "drivers/netbox/configuration/configuration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/algorithm/string.hpp>
#include <cmath>
#include <iterator>
#include <pugixml.hpp>
#include <span>
#include <utility>

#include "base/error.hpp"
#include "base/number.hpp"
#include "base/text.hpp"
#include "drivers/netbox/wire/unit.hpp"

namespace kphi::netbox {
namespace {

constexpr double kFilterCutoffHz[] = {0, 838, 326, 152, 73, 35, 18, 8, 5, 1500, 2000, 2500, 3000};

/// The elements of one document, and the ways to refuse them.
class Elements {
 public:
  Elements(std::string_view xml, std::string device) : device_(std::move(device)) {
    if (xml.find('\0') != std::string_view::npos) {
      refuse(fmt::format("the page holds a NUL byte at {}: it is not in UTF-8", xml.find('\0')),
             "check that no proxy is between this computer and the box, then power-cycle the box");
    }
    const pugi::xml_parse_result result = document_.load_buffer(xml.data(), xml.size());
    if (!result) {
      refuse(fmt::format("the XML is broken at byte {}: {}", result.offset, result.description()),
             "try again, then power-cycle the box");
    }
    root_ = document_.child("netft");
    if (!root_) refuse("no element <netft>", "check that this is a Net Box: open its address in a browser");
  }

  [[noreturn]] void refuse(const std::string& cause, const std::string& next_move) const {
    throw DeviceError(device_, "read the configuration", cause, next_move);
  }

  [[nodiscard]] std::string optional_text(const char* name) const {
    const auto found = root_.children(name);
    if (std::distance(found.begin(), found.end()) > 1)
      refuse(fmt::format("element <{}> appears more than once", name), kAskForXml);
    return printable(boost::algorithm::trim_copy(std::string(root_.child_value(name))));
  }

  [[nodiscard]] std::string text(const char* name) const {
    std::string value = optional_text(name);
    if (value.empty()) refuse(fmt::format("element <{}> is missing or empty", name), kAskForXml);
    return value;
  }

  [[nodiscard]] double number(const char* name) const { return parse_number(name, text(name)); }

  [[nodiscard]] int whole_number(const char* name, int low, int high) const {
    const double value = number(name);
    if (!(value >= low && value <= high) || value != std::floor(value))
      refuse(fmt::format("<{}> is {}, not a whole number from {} to {}", name, value, low, high), kAskForXml);
    return static_cast<int>(value);
  }

  [[nodiscard]] bool flag(const char* name) const {
    const std::string value = text(name);
    if (boost::algorithm::iequals(value, "enabled") || value == "1") return true;
    if (boost::algorithm::iequals(value, "disabled") || value == "0") return false;
    refuse(fmt::format("<{}> is \"{}\", neither Enabled nor Disabled", name, value), kAskForXml);
  }

  /// Six numbers, separated by ; or , or blanks.
  [[nodiscard]] std::array<double, 6> six(const char* name) const {
    const std::string value = text(name);
    const std::vector<std::string> parts = parts_of(value);
    std::array<double, 6> numbers{};
    if (parts.size() != numbers.size()) refuse(fmt::format("<{}> is \"{}\", not six numbers", name, value), kAskForXml);
    std::ranges::transform(parts, numbers.begin(), [&](const auto& part) { return parse_number(name, part); });
    return numbers;
  }

  /// One whole number for each monitor condition; nothing when the box shows it otherwise, or not at all.
  [[nodiscard]] std::optional<std::array<int, 16>> sixteen(const char* name) const {
    const std::vector<std::string> parts = parts_of(optional_text(name));
    std::array<int, 16> numbers{};
    if (parts.size() != numbers.size()) return std::nullopt;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const auto number = parse_integer<int>(parts[i]);
      if (!number) return std::nullopt;
      numbers[i] = *number;
    }
    return numbers;
  }

  /// By its name; by its code where the box gives no name.
  [[nodiscard]] Unit unit(const char* name_element, const char* code_element, std::span<const Unit> units) const {
    const std::string name = optional_text(name_element);
    const int code = name.empty() ? whole_number(code_element, 0, 255) : 0;
    const auto known = std::ranges::find_if(
        units, [&](const Unit& candidate) { return name.empty() ? candidate.code == code : candidate.name == name; });
    if (known == units.end()) {
      refuse(fmt::format("<{}> is the unknown unit \"{}\"", name.empty() ? code_element : name_element,
                         name.empty() ? std::to_string(code) : name),
             "choose N and N-m on the box's Configurations page");
    }
    return *known;
  }

  static constexpr const char* kAskForXml = "open netftapi2.xml in a browser and compare";

 private:
  [[nodiscard]] static std::vector<std::string> parts_of(const std::string& value) {
    std::vector<std::string> parts;
    boost::algorithm::split(parts, value, boost::algorithm::is_any_of(";, \t\r\n"),
                            boost::algorithm::token_compress_on);
    return parts;
  }

  [[nodiscard]] double parse_number(const char* name, const std::string& text) const {
    const auto value = parse_finite(text);
    if (!value) refuse(fmt::format("<{}> holds \"{}\", not a number", name, text), kAskForXml);
    return *value;
  }

  std::string device_;
  pugi::xml_document document_;
  pugi::xml_node root_;
};

/// Rates of the Axia's converter: what it shows, and what all five are rounded down from.
constexpr std::pair<int, double> kAxiaRates[] = {
    {488, 7812.5 / 16}, {976, 7812.5 / 8}, {1953, 7812.5 / 4}, {3906, 7812.5 / 2}, {7812, 7812.5}};

/// What a product's name contains, letters only, small.
constexpr std::pair<const char*, Product> kProductNames[] = {
    {"axia", Product::axia}, {"netft", Product::net_box}, {"netbox", Product::net_box}};

Product kind_of(const Elements& elements, const Configuration& configuration) {
  std::string name = boost::algorithm::to_lower_copy(configuration.product);
  std::erase_if(name, [](char c) { return c < 'a' || c > 'z'; });
  for (const auto& [part, kind] : kProductNames) {
    if (boost::algorithm::contains(name, part)) return kind;
  }
  // Only the Axia has the rate of its converter in its XML; the Net Box's firmware is 1.x or 2.x.
  if (!elements.optional_text("setrate").empty()) return Product::axia;
  const std::string& firmware = configuration.firmware;
  const bool of_net_box =
      boost::algorithm::starts_with(firmware, "1.") || boost::algorithm::starts_with(firmware, "2.");
  if (name.empty() && of_net_box) return Product::net_box;
  elements.refuse(fmt::format("\"{}\" with firmware {} is neither a Net Box nor an Ethernet Axia: its commands and "
                              "status word are unknown",
                              configuration.product, firmware),
                  "use a Net Box or an Ethernet Axia");
}

void read_identity(const Elements& elements, Configuration& configuration) {
  configuration.product = elements.optional_text("prodname");
  configuration.firmware = elements.text("mfgdigver");
  configuration.serial = elements.optional_text("mfgdigsn");
  configuration.slot = elements.whole_number("setcfgsel", 0, 15);
  configuration.calibration = parse_integer<int>(elements.optional_text("cfgcalsel")).value_or(configuration.slot);
  configuration.slot_name = elements.optional_text("cfgnam");
  configuration.calibration_serial = elements.text("cfgcalsn");
  configuration.kind = kind_of(elements, configuration);
  if (configuration.calibration_serial == "FT0000") {
    elements.refuse(fmt::format("slot {} uses an empty calibration (FT0000)", configuration.slot),
                    "choose a calibration on the box's Configurations page");
  }
}

void read_scale(const Elements& elements, Configuration& configuration) {
  const Unit force = elements.unit("scfgfu", "cfgfu", kForceUnits);
  const Unit torque = elements.unit("scfgtu", "cfgtu", kTorqueUnits);
  const double counts_per_force = elements.number("cfgcpf");
  const double counts_per_torque = elements.number("cfgcpt");
  if (!(counts_per_force > 0) || !(counts_per_torque > 0)) {
    elements.refuse(
        fmt::format("counts per unit are {} and {}: the slot is not usable", counts_per_force, counts_per_torque),
        "choose another configuration slot on the box's Settings page");
  }
  configuration.force_unit = force.name;
  configuration.torque_unit = torque.name;
  configuration.counts_per_newton = counts_per_force / force.si;
  configuration.counts_per_newton_metre = counts_per_torque / torque.si;
  configuration.range = elements.six("cfgmr");
  for (std::size_t axis = 0; axis < 6; ++axis) {
    if (!(configuration.range[axis] > 0)) {
      elements.refuse("a sensing range (<cfgmr>) is not above zero: the slot is not usable",
                      "choose another configuration slot on the box's Settings page");
    }
    configuration.range[axis] *= axis < 3 ? force.si : torque.si;
  }
}

double device_rate_hz(const Elements& elements, Product kind) {
  if (kind == Product::axia && !elements.optional_text("setrate").empty()) {
    const int shown = elements.whole_number("setrate", 1, 1'000'000);
    for (const auto& [known, true_hz] : kAxiaRates) {
      if (known == shown) return true_hz;
    }
    elements.refuse(fmt::format("<setrate> is {}: an Ethernet Axia has 488, 976, 1953, 3906 and 7812 Hz", shown),
                    "choose one of these on the sensor's Settings page");
  }
  return elements.whole_number("runrate", 1, 1'000'000);
}

void read_stream(const Elements& elements, Configuration& configuration) {
  const double device_rate = device_rate_hz(elements, configuration.kind);
  const int shown_rate = elements.whole_number("comrdtrate", 1, static_cast<int>(device_rate));
  configuration.device_rate_hz = device_rate;
  // The box runs whole fractions only and shows them rounded down; this finds the fraction again.
  configuration.divisor = static_cast<unsigned>(device_rate / shown_rate);
  configuration.rdt_rate_hz = device_rate / configuration.divisor;
  configuration.records_per_datagram = elements.whole_number("comrdtbsiz", 1, 40);
  configuration.rdt_enabled = elements.flag("comrdte");
  configuration.filter_code = elements.whole_number("setuserfilter", 0, std::size(kFilterCutoffHz) - 1);
}

void read_monitor(const Elements& elements, Configuration& configuration) {
  configuration.monitoring = elements.optional_text("setmce") == "1";
  const auto on = elements.sixteen("mce"), axis = elements.sixteen("mcx"), sign = elements.sixteen("mcc"),
             counts = elements.sixteen("mcv");
  if (!on || !axis || !sign || !counts) return;
  std::vector<MonitorCondition> conditions;
  for (std::size_t i = 0; i < on->size(); ++i) {
    if ((*on)[i] != 1 || (*axis)[i] < 0 || (*axis)[i] > 5) continue;
    const double per_unit = configuration.counts_per_unit(static_cast<std::size_t>((*axis)[i]));
    conditions.push_back({(*axis)[i], (*sign)[i] > 0, (*counts)[i] / per_unit});
  }
  configuration.monitor_conditions = std::move(conditions);
}

struct Row {
  Change change;
  const char* name;
  bool (*differs)(const Configuration&, const Configuration&);
};

template <auto... Members>
constexpr bool differ(const Configuration& a, const Configuration& b) {
  return ((a.*Members != b.*Members) || ...);
}

using C = Configuration;
constexpr Row kTable[] = {
    {Change::product, "product", differ<&C::product, &C::kind, &C::serial>},
    {Change::firmware, "firmware", differ<&C::firmware>},
    {Change::calibration, "calibration", differ<&C::calibration_serial>},
    {Change::slot, "configuration slot", differ<&C::slot>},
    {Change::units, "units", differ<&C::force_unit, &C::torque_unit>},
    {Change::counts_per_unit, "counts per unit", differ<&C::counts_per_newton, &C::counts_per_newton_metre>},
    {Change::ranges, "ranges", differ<&C::range>},
    {Change::rate, "rate", differ<&C::divisor, &C::device_rate_hz>},
    {Change::records_per_datagram, "records per datagram", differ<&C::records_per_datagram>},
    {Change::filter, "filter", differ<&C::filter_code>},
    {Change::tool_transform, "tool transform", differ<&C::tool_transform, &C::tool_distance_unit, &C::tool_angle_unit>},
    {Change::gage_bias, "gage bias", differ<&C::gage_bias>},
};

}  // namespace

std::optional<double> filter_cutoff_hz(int filter_code) noexcept {
  if (filter_code < 0 || filter_code >= static_cast<int>(std::size(kFilterCutoffHz))) return std::nullopt;
  return kFilterCutoffHz[filter_code];
}

std::optional<double> filter_cutoff_hz(const Configuration& box) noexcept {
  if (box.kind == Product::axia && box.filter_code != 0) return std::nullopt;
  return filter_cutoff_hz(box.filter_code);
}

Configuration parse_configuration(std::string_view xml, const std::string& device) {
  const Elements elements(xml, device);
  Configuration configuration;
  read_identity(elements, configuration);
  read_scale(elements, configuration);
  read_stream(elements, configuration);
  configuration.tool_transform = elements.six("cfgtfx");
  configuration.tool_distance_unit = elements.text("scfgtdu");
  configuration.tool_angle_unit = elements.text("scfgtau");
  configuration.gage_bias = elements.six("setbias");
  if (elements.optional_text("setpke") == "1" && !elements.optional_text("runpkmx").empty())
    configuration.peaks = Peaks{elements.six("runpkmx"), elements.six("runpkmn")};
  read_monitor(elements, configuration);
  configuration.xml = xml;
  return configuration;
}

Changes compare(const Configuration& before, const Configuration& after) {
  Changes changes = 0;
  for (const Row& row : kTable) {
    if (row.differs(before, after)) changes |= static_cast<Changes>(row.change);
  }
  return changes;
}

std::string to_words(Changes changes) {
  std::string words;
  for (const Row& row : kTable) {
    if (has(changes, row.change)) words += (words.empty() ? "" : ", ") + std::string(row.name);
  }
  return words;
}

bool forgot_peaks(const Configuration& before, const Configuration& after) noexcept {
  if (!before.peaks || !after.peaks) return false;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    if (after.peaks->high[axis] < before.peaks->high[axis] || after.peaks->low[axis] > before.peaks->low[axis])
      return true;
  }
  return false;
}

}  // namespace kphi::netbox
