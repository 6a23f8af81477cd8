#include "drivers/ambient/mcp2221.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "base/error.hpp"

namespace kphi::ambient {
namespace {

using namespace std::chrono_literals;

constexpr auto kBetweenCommands = 1ms;
constexpr usb::Transport::Timeout kReply = 500ms;
constexpr int kAttempts = 20;     // while the bridge reports busy, one pause apart
constexpr int kStaleReplies = 4;  // answers to commands of a process that was killed
constexpr std::size_t kPayload = 60;
constexpr std::uint8_t kHid = 0x03;

enum Command : std::uint8_t {
  status = 0x10,
  get_data = 0x40,
  get_settings = 0x61,
  write_stop = 0x90,
  read_restart = 0x93,
  write_no_stop = 0x94
};
constexpr std::uint8_t kCancelTransfer = 0x10, kSetSpeed = 0x20, kSpeedBusy = 0x21;
constexpr std::uint8_t kDivider100kHz = 12'000'000 / 100'000 - 3;

constexpr std::uint8_t kIdle = 0x00, kBusy = 0x01, kAddressNack = 0x25, kPartialData = 0x41, kWritingNoStop = 0x45,
                       kReadPartial = 0x54, kReadComplete = 0x55, kReadError = 127;

/// By state of the engine.
constexpr std::pair<std::uint8_t, const char*> kMeanings[] = {{0x12, "no start condition: the bus is held low"},
                                                              {0x17, "no start condition: the bus is held low"},
                                                              {0x21, "no device answers at this address"},
                                                              {kAddressNack, "no device answers at this address"},
                                                              {0x23, "the address took too long"},
                                                              {0x44, "the write took too long"},
                                                              {0x52, "the read took too long"},
                                                              {0x62, "no stop condition: the bus is held low"},
                                                              {kBusy, "the bridge stays busy"}};

const char* meaning(std::uint8_t engine_state) noexcept {
  for (const auto& [state, words] : kMeanings)
    if (state == engine_state) return words;
  return "the bridge reports an error";
}

}  // namespace

Mcp2221::Mcp2221(usb::Transport& transport, Pause pause) : transport_(transport), pause_(std::move(pause)) {
  const auto& all = transport.interfaces();
  const auto hid = std::ranges::find_if(all, [](const usb::Interface& i) { return i.class_code == kHid; });
  const auto endpoint = [&](bool in) {
    const auto found = std::ranges::find_if(hid->endpoints, [in](const usb::Endpoint& e) {
      return e.kind == usb::EndpointKind::interrupt && e.in() == in;
    });
    return found == hid->endpoints.end() ? usb::Endpoint{} : *found;
  };
  if (hid != all.end()) {
    in_ = endpoint(true);
    out_ = endpoint(false);
  }
  if (in_.address == 0 || out_.address == 0)
    fail("open", "it has no HID interface with two interrupt endpoints", "check that this is an MCP2221A");
  transport_.claim(hid->number);
  cancel();
  set_speed();
}

void Mcp2221::sleep(std::chrono::microseconds wall) { std::this_thread::sleep_for(wall); }

void Mcp2221::write(std::uint8_t address, std::span<const std::uint8_t> bytes) {
  send(write_stop, address, bytes.size(), bytes, "write");
  wait_until_idle("write");
}

void Mcp2221::read(std::uint8_t address, std::uint8_t register_number, std::span<std::uint8_t> into) {
  send(write_no_stop, address, 1, {&register_number, 1}, "address a register");
  wait_until_idle("address a register");
  send(read_restart, address, into.size(), {}, "read");
  std::size_t have = 0;
  for (int attempt = 0; attempt < kAttempts && have < into.size(); ++attempt) {
    const Report reply = exchange({get_data}, "read");
    const std::uint8_t state = reply[2], count = reply[3];
    if (state == kAddressNack) fail("read", state);
    const bool data =
        reply[1] == 0 && (state == kIdle || state == kPartialData || state == kReadPartial || state == kReadComplete);
    if (!data || count == kReadError || count == 0) continue;  // not there yet
    if (count > kPayload || count > into.size() - have)
      fail("read", "received more bytes than requested", "plug the bridge in again");
    std::copy_n(reply.begin() + 4, count, into.begin() + static_cast<std::ptrdiff_t>(have));
    have += count;
    attempt = 0;
  }
  if (have < into.size()) fail("read", kBusy);
}

Mcp2221::Report Mcp2221::exchange(const Report& command, const char* operation) {
  // Answers come in the order of the commands: those before the answer to a command that is used only here are old.
  if (!in_step_) converse({get_settings}, "synchronise");
  in_step_ = false;
  const Report reply = converse(command, operation);
  in_step_ = true;
  return reply;
}

/// Only the echoed command code tells which command an answer belongs to.
Mcp2221::Report Mcp2221::converse(const Report& command, const char* operation) {
  constexpr const char* kPlugged = "check that the bridge is plugged in";
  pause_(kBetweenCommands);
  const usb::Transfer sent = transport_.write(out_, command, kReply);
  if (sent.outcome != usb::Outcome::done) fail(operation, usb::name_of(sent.outcome), kPlugged);
  Report reply{};
  for (int i = 0; i < kStaleReplies; ++i) {
    const usb::Transfer got = transport_.read(in_, reply, kReply);
    if (got.outcome == usb::Outcome::stalled) {
      (void)transport_.clear_halt(in_);
      continue;
    }
    if (got.outcome != usb::Outcome::done) fail(operation, usb::name_of(got.outcome), kPlugged);
    if (got.bytes == reply.size() && reply[0] == command[0]) return reply;
  }
  fail(operation, "received answers to other commands", "close other programs that use the bridge");
}

void Mcp2221::set_speed() {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const Report reply = exchange({status, 0, 0, kSetSpeed, kDivider100kHz}, "set the bus speed");
    if (reply[3] == kSetSpeed) return;
    if (reply[3] != kSpeedBusy) break;
    cancel();
  }
  fail("set the bus speed", kBusy);
}

void Mcp2221::cancel() { exchange({status, 0, kCancelTransfer}, "free the bus"); }

void Mcp2221::send(std::uint8_t command_code, std::uint8_t address, std::size_t total,
                   std::span<const std::uint8_t> data, const char* operation) {
  Report command{command_code, static_cast<std::uint8_t>(total), static_cast<std::uint8_t>(total >> 8),
                 static_cast<std::uint8_t>(address << 1)};
  if (data.size() > kPayload) fail(operation, "more than 60 bytes at once", "");
  std::copy(data.begin(), data.end(), command.begin() + 4);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const Report reply = exchange(command, operation);
    if (reply[1] == 0) return;
    if (reply[2] != kBusy && reply[2] != kIdle) fail(operation, reply[2]);
  }
  fail(operation, kBusy);
}

void Mcp2221::wait_until_idle(const char* operation) {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const Report reply = exchange({status}, operation);
    const std::uint8_t state = reply[8];
    if (state == kAddressNack || (reply[20] & 0x40) != 0) fail(operation, kAddressNack);
    if (state == kIdle || state == kWritingNoStop) return;
    if (state == 0x12 || state == 0x17 || state == 0x23 || state == 0x44 || state == 0x62) fail(operation, state);
  }
  fail(operation, kBusy);
}

void Mcp2221::fail(const char* operation, const std::string& cause, const char* next_move) const {
  throw DeviceError("MCP2221A (" + transport_.name() + ")", operation, cause, next_move);
}

void Mcp2221::fail(const char* operation, std::uint8_t engine_state) {
  // Leave the bus free for the next call; the failure is reported either way.
  try {
    cancel();
  } catch (const DeviceError&) {
  }
  fail(operation, fmt::format("{} (engine state 0x{:02X})", meaning(engine_state), engine_state),
       "check the sensor's wiring and address, then plug the bridge in again");
}

}  // namespace kphi::ambient
