#include "drivers/supply/modbus_link.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <thread>

#include "drivers/serial/port.hpp"

namespace kphi::supply {
namespace {

using std::chrono::steady_clock;
constexpr auto kLongestQuiet = std::chrono::seconds(2);
constexpr double kBitsPerByte = 10, kSilentBytes = 3.5;

Outcome outcome_of(int error) {
  if (error == ETIMEDOUT) return {Failure::timeout, "no answer"};
  for (const int damage : {EMBBADCRC, EMBBADDATA, EMBBADSLAVE, EMBBADEXC, EMBUNKEXC})
    if (error == damage) return {Failure::damaged, fmt::format("damaged answer ({})", modbus_strerror(error))};
  if (error <= MODBUS_ENOBASE) return {Failure::lost, fmt::format("the line is lost ({})", std::strerror(error))};
  return {error == EMBXSBUSY || error == EMBXACK ? Failure::busy : Failure::refused,
          fmt::format("the device answers \"{}\"", modbus_strerror(error))};
}

modbus_t* make_context(const Address& address) {
  if (address.wire == Address::Wire::tcp) {
    return modbus_new_tcp_pi(address.tcp.host.c_str(), std::to_string(address.tcp.port).c_str());
  }
  return modbus_new_rtu(address.device.c_str(), static_cast<int>(address.baud), 'N', 8, 1);
}

std::uint32_t microseconds(std::chrono::milliseconds time) { return static_cast<std::uint32_t>(time.count() * 1000); }

}  // namespace

ModbusLink::ModbusLink(const Address& address, const Timing& timing)
    : address_(address), timing_(timing), context_(make_context(address), &modbus_free), last_(steady_clock::now()) {
  if (!context_) throw std::invalid_argument(fmt::format("supply \"{}\": {}", address.uri, modbus_strerror(errno)));
  modbus_set_slave(context_.get(), address.slave);
  modbus_set_error_recovery(context_.get(), MODBUS_ERROR_RECOVERY_NONE);
  modbus_set_response_timeout(context_.get(), microseconds(timing.answer) / 1'000'000,
                              microseconds(timing.answer) % 1'000'000);
  modbus_set_byte_timeout(context_.get(), microseconds(timing.byte) / 1'000'000, microseconds(timing.byte) % 1'000'000);
}

ModbusLink::~ModbusLink() { close(); }

void ModbusLink::close() noexcept {
  if (!open_) return;
  if (address_.wire == Address::Wire::rtu) ioctl(modbus_get_socket(context_.get()), TIOCNXCL);
  modbus_close(context_.get());
  open_ = false;
}

Outcome ModbusLink::open() {
  close();
  if (modbus_connect(context_.get()) != 0) {
    const int error = errno;
    return {Failure::lost, error > MODBUS_ENOBASE ? modbus_strerror(error) : std::strerror(error)};
  }
  open_ = true;
  last_ = steady_clock::now();
  if (address_.wire == Address::Wire::tcp) return {};
  Outcome taken = take_port();
  if (!taken.ok()) close();
  return taken;
}

Outcome ModbusLink::take_port() {
  const int port = modbus_get_socket(context_.get());
  if (isatty(port) == 0) return {Failure::lost, "not a serial port"};
  if (!serial::runs_at(port, address_.baud))
    return {Failure::lost, fmt::format("the port does not accept {} baud", address_.baud)};
  if (flock(port, LOCK_EX | LOCK_NB) != 0) return {Failure::lost, "in use by another program"};
  ioctl(port, TIOCEXCL);
  return {};
}

Outcome ModbusLink::read(const Block& block, RegisterImage& into) {
  if (block.first + block.count > into.size()) throw std::logic_error("a block of registers beyond the image");
  if (!open_) return {Failure::lost, "the line is not open"};
  keep_gap();
  RegisterImage fresh{};
  const int result = modbus_read_registers(context_.get(), block.first, block.count, fresh.data());
  Outcome all = outcome(result, block.count);
  if (all.ok()) std::copy_n(fresh.begin(), block.count, into.begin() + block.first);
  return all;
}

Outcome ModbusLink::write(Writable at, std::uint16_t value, bool multiple) {
  if (!open_) return {Failure::lost, "the line is not open"};
  keep_gap();
  const int result = multiple ? modbus_write_registers(context_.get(), at, 1, &value)
                              : modbus_write_register(context_.get(), at, value);
  return outcome(result, 1);
}

Outcome ModbusLink::outcome(int result, int expected) {
  const int error = errno;
  last_ = steady_clock::now();
  if (result == expected) return {};
  if (result >= 0) return {Failure::damaged, "answer of the wrong length"};
  Outcome failed = outcome_of(error);
  if (failed.failure == Failure::lost) close();
  return failed;
}

void ModbusLink::fall_silent() {
  if (!open_) return;
  const bool tcp = address_.wire == Address::Wire::tcp;
  for (const auto end = steady_clock::now() + kLongestQuiet; steady_clock::now() < end;) {
    pollfd line{modbus_get_socket(context_.get()), POLLIN, 0};
    const int arrived = ::poll(&line, 1, static_cast<int>(timing_.quiet.count()));
    if (arrived <= 0 || (line.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) break;
    const int flushed = modbus_flush(context_.get());  // bytes of TCP, 0 on a serial line
    if (flushed < 0 || (tcp && flushed == 0)) break;   // closed by the device: the next request reports it
  }
  modbus_flush(context_.get());
}

/// 3.5 bytes of silence separate frames (Modbus over serial line 1.02, 2.5.1.1).
void ModbusLink::keep_gap() const {
  if (address_.wire == Address::Wire::tcp) return;
  const std::chrono::duration<double> gap(std::max(kSilentBytes * kBitsPerByte / address_.baud, 0.00175));
  std::this_thread::sleep_until(last_ + std::chrono::duration_cast<steady_clock::duration>(gap));
}

}  // namespace kphi::supply
