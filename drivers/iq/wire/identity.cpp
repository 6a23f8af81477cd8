#include "drivers/iq/wire/identity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iterator>

namespace kphi::iq {
namespace {

std::string style_text(int style) {
  constexpr const char* names[] = {"", "speed", "servo", "pulsing", "step/dir", "", "pulsing velocity"};
  const bool known = style >= 0 && style < static_cast<int>(std::size(names)) && *names[style] != 0;
  return known ? names[style] : fmt::format("style {}", style);
}

std::string value_text(const Entry& entry, double value) {
  return entry.format == Format::f32 ? fmt::format("{}", static_cast<float>(value)) : fmt::format("{:.0f}", value);
}

template <class Version>
std::optional<Version> version_of(const std::optional<double>& word) {
  return word ? std::optional(Version(static_cast<std::uint32_t>(*word))) : std::nullopt;
}

}  // namespace

std::string FirmwareVersion::text() const { return fmt::format("{} {}.{}.{}", style_text(style), major, minor, patch); }

std::string BoardVersion::text() const { return fmt::format("type {}.{} batch {}", type, major, batch); }

std::optional<FirmwareVersion> AuditRecord::firmware() const {
  return version_of<FirmwareVersion>(value<"system_control.firmware_version">());
}

std::optional<BoardVersion> AuditRecord::hardware() const {
  return version_of<BoardVersion>(value<"system_control.hardware_version">());
}

std::optional<BoardVersion> AuditRecord::electronics() const {
  return version_of<BoardVersion>(value<"system_control.electronics_version">());
}

std::string AuditRecord::uid() const {
  const auto a = value<"system_control.uid1">(), b = value<"system_control.uid2">(), c = value<"system_control.uid3">();
  if (!a || !b || !c) return "";
  return fmt::format("{:08x}{:08x}{:08x}", static_cast<std::uint32_t>(*a), static_cast<std::uint32_t>(*b),
                     static_cast<std::uint32_t>(*c));
}

int AuditRecord::coil_temperature_client() const {
  if (value<"coil_temperature_estimator.t_coil">()) return static_cast<int>(Client::coil_temperature_estimator);
  return value<"temperature_estimator.temp">() ? static_cast<int>(Client::temperature_estimator) : 0;
}

std::string AuditRecord::text() const {
  std::string text;
  const auto decoded = [&](const char* name, const std::string& words) {
    if (!words.empty()) text += fmt::format("{}: {}\n", name, words);
  };
  decoded("uid", uid().empty() ? "" : '"' + uid() + '"');
  decoded("firmware", firmware() ? firmware()->text() : "");
  decoded("hardware", hardware() ? hardware()->text() : "");
  decoded("electronics", electronics() ? electronics()->text() : "");
  for (const auto& [told, value] : values) {
    text +=
        fmt::format("{}: {}{}{}\n", told->path, value_text(*told, value), told->unit.empty() ? "" : "  # ", told->unit);
  }
  return text;
}

AuditRecord AuditRecord::of(std::string_view text) {
  AuditRecord record;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    const std::size_t colon = line.find(": ");
    const Entry* told = colon == std::string_view::npos ? nullptr : find(line.substr(0, colon));
    double value = 0;
    if (told == nullptr || !told->audited) continue;
    if (std::from_chars(line.data() + colon + 2, line.data() + line.size(), value).ec == std::errc())
      record.values[told] = value;
  }
  return record;
}

std::string AuditRecord::summary() const {
  const auto known = [](const auto& version) { return version ? version->text() : std::string("?"); };
  std::string text = fmt::format("firmware {}, hardware {}, electronics {}, uid {}, timeout {} s, ", known(firmware()),
                                 known(hardware()), known(electronics()), uid(),
                                 value<"propeller_motor_control.timeout">().value_or(0));
  const int client = coil_temperature_client();
  text += client == 0 ? "no coil temperature" : fmt::format("coil temperature from client {}", client);
  if (!value<"propeller_motor_control.timeout_behavior">()) text += ", old firmware: plays its song after a timeout";
  const int faults = static_cast<int>(value<"power_safety.fault_now">().value_or(0));
  if (faults != 0) text += fmt::format(", FAULT bits {:#04x}", faults);
  return text;
}

}  // namespace kphi::iq
