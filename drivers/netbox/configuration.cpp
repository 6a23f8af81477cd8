#include "drivers/netbox/configuration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/algorithm/string.hpp>
#include <charconv>
#include <cmath>
#include <iterator>
#include <pugixml.hpp>
#include <span>
#include <vector>

#include "drivers/device_error.hpp"
#include "drivers/netbox/units.hpp"

namespace kphi::netbox {
namespace {

constexpr double kFilterCutoffHz[] = {0, 838, 326, 152, 73, 35, 18, 8, 5, 1500, 2000, 2500, 3000};

/// The elements of one document, and the ways to refuse them.
class Elements {
 public:
  Elements(std::string_view xml, std::string device) : device_(std::move(device)) {
    const pugi::xml_parse_result result = document_.load_buffer(xml.data(), xml.size());
    if (!result) {
      refuse(fmt::format("the XML is broken at byte {}: {}", result.offset, result.description()),
             "try again; the box may have broken off");
    }
    root_ = document_.child("netft");
    if (!root_) refuse("no element <netft>", "is this a Net Box? Open its address in a browser");
  }

  [[noreturn]] void refuse(const std::string& cause, const std::string& next_move) const {
    throw DeviceError(device_, "read the configuration", cause, next_move);
  }

  [[nodiscard]] std::string optional_text(const char* name) const {
    const auto found = root_.children(name);
    if (std::distance(found.begin(), found.end()) > 1)
      refuse(fmt::format("element <{}> appears more than once", name), kAskForXml);
    return boost::algorithm::trim_copy(std::string(root_.child_value(name)));
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
    std::vector<std::string> parts;
    boost::algorithm::split(parts, value, boost::algorithm::is_any_of(";, \t\r\n"),
                            boost::algorithm::token_compress_on);
    std::array<double, 6> numbers{};
    if (parts.size() != numbers.size()) refuse(fmt::format("<{}> is \"{}\", not six numbers", name, value), kAskForXml);
    std::transform(parts.begin(), parts.end(), numbers.begin(),
                   [&](const std::string& part) { return parse_number(name, part); });
    return numbers;
  }

  /// By its name; by its code where the box gives no name.
  [[nodiscard]] Unit unit(const char* name_element, const char* code_element, std::span<const Unit> units) const {
    const std::string name = optional_text(name_element);
    const int code = name.empty() ? whole_number(code_element, 0, 255) : 0;
    const auto known = std::find_if(units.begin(), units.end(), [&](const Unit& candidate) {
      return name.empty() ? candidate.code == code : candidate.name == name;
    });
    if (known == units.end()) {
      refuse(fmt::format("<{}> is the unknown unit \"{}\"", name.empty() ? code_element : name_element,
                         name.empty() ? std::to_string(code) : name),
             "choose N and N-m on the box's Configurations page");
    }
    return *known;
  }

  static constexpr const char* kAskForXml = "open netftapi2.xml in a browser and compare";

 private:
  [[nodiscard]] double parse_number(const char* name, const std::string& text) const {
    double value = 0;
    const char* end = text.data() + text.size();
    const auto [stopped, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc{} || stopped != end || !std::isfinite(value))
      refuse(fmt::format("<{}> holds \"{}\", not a number", name, text), kAskForXml);
    return value;
  }

  std::string device_;
  pugi::xml_document document_;
  pugi::xml_node root_;
};

void read_identity(const Elements& elements, Configuration& configuration) {
  configuration.product = elements.optional_text("prodname");
  configuration.firmware = elements.text("mfgdigver");
  configuration.slot = elements.whole_number("setcfgsel", 0, 15);
  configuration.slot_name = elements.optional_text("cfgnam");
  configuration.calibration_serial = elements.text("cfgcalsn");
  if (boost::algorithm::icontains(configuration.product, "axia")) {
    elements.refuse(fmt::format("\"{}\" is an Ethernet Axia: commands and status word differ from the Net Box's",
                                configuration.product),
                    "use a Net Box");
  }
  if (configuration.calibration_serial == "FT0000") {
    elements.refuse(fmt::format("slot {} uses an empty calibration (FT0000)", configuration.slot),
                    "choose a calibration on the box's Configurations page");
  }
}

void read_scale(const Elements& elements, Configuration& configuration) {
  const Unit force = elements.unit("scfgfu", "cfgfu", force_units());
  const Unit torque = elements.unit("scfgtu", "cfgtu", torque_units());
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

void read_stream(const Elements& elements, Configuration& configuration) {
  const int device_rate = elements.whole_number("runrate", 1, 1'000'000);
  const int shown_rate = elements.whole_number("comrdtrate", 1, device_rate);
  configuration.device_rate_hz = device_rate;
  // The box runs whole fractions only and shows them rounded down; this finds the fraction again.
  configuration.divisor = static_cast<unsigned>(device_rate / shown_rate);
  configuration.rdt_rate_hz = static_cast<double>(device_rate) / configuration.divisor;
  configuration.records_per_datagram = elements.whole_number("comrdtbsiz", 1, 40);
  configuration.rdt_enabled = elements.flag("comrdte");
  configuration.filter_code = elements.whole_number("setuserfilter", 0, std::size(kFilterCutoffHz) - 1);
}

}  // namespace

std::optional<double> filter_cutoff_hz(int filter_code) noexcept {
  if (filter_code < 0 || filter_code >= static_cast<int>(std::size(kFilterCutoffHz))) return std::nullopt;
  return kFilterCutoffHz[filter_code];
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
  configuration.xml = xml;
  return configuration;
}

}  // namespace kphi::netbox
