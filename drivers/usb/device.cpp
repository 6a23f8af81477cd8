#include "drivers/usb/device.hpp"

#include <fmt/format.h>
#include <libusb.h>

#include <algorithm>
#include <cstring>

#include "base/error.hpp"

namespace kphi::usb {
namespace {

EndpointKind kind_of(std::uint8_t attributes) noexcept {
  switch (attributes & LIBUSB_TRANSFER_TYPE_MASK) {
    case LIBUSB_TRANSFER_TYPE_BULK:
      return EndpointKind::bulk;
    case LIBUSB_TRANSFER_TYPE_INTERRUPT:
      return EndpointKind::interrupt;
    default:
      return EndpointKind::other;
  }
}

/// The interfaces of the active configuration, in their first setting.
std::vector<Interface> interfaces_of(libusb_device* device) {
  std::vector<Interface> interfaces;
  libusb_config_descriptor* configuration = nullptr;
  if (libusb_get_active_config_descriptor(device, &configuration) != 0) return interfaces;
  for (int i = 0; i < configuration->bNumInterfaces; ++i) {
    if (configuration->interface[i].num_altsetting < 1) continue;
    const libusb_interface_descriptor& setting = configuration->interface[i].altsetting[0];
    Interface one{
        setting.bInterfaceNumber, setting.bInterfaceClass, setting.bInterfaceSubClass, setting.bInterfaceProtocol, {}};
    for (int e = 0; e < setting.bNumEndpoints; ++e) {
      const libusb_endpoint_descriptor& endpoint = setting.endpoint[e];
      one.endpoints.push_back({endpoint.bEndpointAddress, kind_of(endpoint.bmAttributes), endpoint.wMaxPacketSize});
    }
    interfaces.push_back(std::move(one));
  }
  libusb_free_config_descriptor(configuration);
  return interfaces;
}

Outcome outcome_of(libusb_transfer_status status) noexcept {
  switch (status) {
    case LIBUSB_TRANSFER_COMPLETED:
      return Outcome::done;
    case LIBUSB_TRANSFER_TIMED_OUT:
      return Outcome::timed_out;
    case LIBUSB_TRANSFER_STALL:
      return Outcome::stalled;
    case LIBUSB_TRANSFER_NO_DEVICE:
      return Outcome::gone;
    case LIBUSB_TRANSFER_CANCELLED:
      return Outcome::cancelled;
    default:
      return Outcome::failed;
  }
}

Outcome outcome_of_error(int error) noexcept {
  switch (error) {
    case 0:
      return Outcome::done;
    case LIBUSB_ERROR_NO_DEVICE:
      return Outcome::gone;
    case LIBUSB_ERROR_PIPE:
      return Outcome::stalled;
    case LIBUSB_ERROR_TIMEOUT:
      return Outcome::timed_out;
    default:
      return Outcome::failed;
  }
}

struct Waiting {
  Device* device;
  bool ended = false;
};

}  // namespace

Device::Device(libusb_device_handle* handle, const Listing& listing)
    : handle_(handle),
      listing_(listing),
      name_("USB device " + to_string(listing)),
      interfaces_(interfaces_of(libusb_get_device(handle))) {
  libusb_set_auto_detach_kernel_driver(handle_, 1);
}

Device::~Device() {
  cancel();
  for (const std::uint8_t number : claimed_) libusb_release_interface(handle_, number);
  libusb_close(handle_);
}

void Device::claim(std::uint8_t interface_number) {
  if (const int error = libusb_claim_interface(handle_, interface_number); error != 0) {
    throw DeviceError(name_, "claim its interface",
                      error == LIBUSB_ERROR_BUSY ? "another program uses it" : libusb_error_name(error),
                      "close the other program, or plug the device in again");
  }
  claimed_.push_back(interface_number);
}

Transfer Device::control_in(const Setup& setup, std::span<std::uint8_t> data, Timeout timeout) noexcept {
  return control(setup, data, true, timeout);
}

Transfer Device::control_out(const Setup& setup, std::span<const std::uint8_t> data, Timeout timeout) noexcept {
  return control(setup, {const_cast<std::uint8_t*>(data.data()), data.size()}, false, timeout);
}

Transfer Device::control(Setup setup, std::span<std::uint8_t> data, bool in, Timeout timeout) noexcept {
  std::vector<std::uint8_t> buffer(LIBUSB_CONTROL_SETUP_SIZE + data.size());
  if (!in) std::copy(data.begin(), data.end(), buffer.begin() + LIBUSB_CONTROL_SETUP_SIZE);
  libusb_fill_control_setup(buffer.data(), setup.request_type, setup.request, setup.value, setup.index,
                            static_cast<std::uint16_t>(data.size()));
  libusb_transfer* transfer = libusb_alloc_transfer(0);
  if (transfer == nullptr) return {Outcome::failed};
  libusb_fill_control_transfer(transfer, handle_, buffer.data(), nullptr, nullptr,
                               static_cast<unsigned>(timeout.count()));
  const Transfer result = carry_out(transfer);
  if (in) std::copy_n(buffer.begin() + LIBUSB_CONTROL_SETUP_SIZE, std::min(result.bytes, data.size()), data.begin());
  return result;
}

Transfer Device::read(const Endpoint& endpoint, std::span<std::uint8_t> data, Timeout timeout) noexcept {
  return move(endpoint, data, timeout);
}

Transfer Device::write(const Endpoint& endpoint, std::span<const std::uint8_t> data, Timeout timeout) noexcept {
  return move(endpoint, {const_cast<std::uint8_t*>(data.data()), data.size()}, timeout);
}

Transfer Device::move(const Endpoint& endpoint, std::span<std::uint8_t> data, Timeout timeout) noexcept {
  libusb_transfer* transfer = libusb_alloc_transfer(0);
  if (transfer == nullptr) return {Outcome::failed};
  const auto milliseconds = static_cast<unsigned>(timeout.count());
  const int size = static_cast<int>(data.size());
  if (endpoint.kind == EndpointKind::interrupt) {
    libusb_fill_interrupt_transfer(transfer, handle_, endpoint.address, data.data(), size, nullptr, nullptr,
                                   milliseconds);
  } else {
    libusb_fill_bulk_transfer(transfer, handle_, endpoint.address, data.data(), size, nullptr, nullptr, milliseconds);
  }
  return carry_out(transfer);
}

Transfer Device::carry_out(libusb_transfer* transfer) noexcept {
  Waiting waiting{this};
  transfer->user_data = &waiting;
  transfer->callback = [](libusb_transfer* ended) { on_end(ended); };
  std::unique_lock lock(mutex_);
  Transfer result{Outcome::cancelled};
  if (!cancelled_) {
    if (const int error = libusb_submit_transfer(transfer); error != 0) {
      result.outcome = outcome_of_error(error);
    } else {
      under_way_ = transfer;
      ended_.wait(lock, [&] { return waiting.ended; });
      under_way_ = nullptr;
      result = {outcome_of(transfer->status), static_cast<std::size_t>(transfer->actual_length)};
    }
  }
  lock.unlock();
  libusb_free_transfer(transfer);
  return result;
}

void Device::on_end(libusb_transfer* transfer) noexcept {
  auto& waiting = *static_cast<Waiting*>(transfer->user_data);
  Device& device = *waiting.device;
  const std::lock_guard lock(device.mutex_);
  waiting.ended = true;
  device.ended_.notify_all();
}

Outcome Device::clear_halt(const Endpoint& endpoint) noexcept {
  return outcome_of_error(libusb_clear_halt(handle_, endpoint.address));
}

void Device::cancel() noexcept {
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
  if (under_way_ != nullptr) libusb_cancel_transfer(under_way_);
}

}  // namespace kphi::usb
