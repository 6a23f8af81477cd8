#include "drivers/usb/bus.hpp"

#include <fmt/format.h>
#include <libusb.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "base/error.hpp"
#include "base/thread.hpp"

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

namespace {

constexpr const char* kRule = "install drivers/udev/60-kphi.rules, or run as a member of the device's group";

std::string port_path(libusb_device* device) {
  std::array<std::uint8_t, 7> ports{};  // USB 3.0: seven tiers at most
  const int n = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  std::string path = fmt::format("{}", libusb_get_bus_number(device));
  for (int i = 0; i < n; ++i) path += fmt::format("{}{}", i == 0 ? '-' : '.', ports[static_cast<std::size_t>(i)]);
  return path;
}

bool is_instrument(libusb_device* device) {
  constexpr std::uint8_t kApplication = 0xFE, kTestAndMeasurement = 0x03;
  libusb_config_descriptor* found = nullptr;
  if (libusb_get_active_config_descriptor(device, &found) != 0) return false;
  const std::unique_ptr<libusb_config_descriptor, decltype(&libusb_free_config_descriptor)> all(
      found, &libusb_free_config_descriptor);
  for (int i = 0; i < all->bNumInterfaces; ++i) {
    const libusb_interface& one = all->interface[i];
    if (one.num_altsetting > 0 && one.altsetting[0].bInterfaceClass == kApplication &&
        one.altsetting[0].bInterfaceSubClass == kTestAndMeasurement)
      return true;
  }
  return false;
}

Listing listing_without_serial(libusb_device* device) {
  libusb_device_descriptor descriptor{};
  libusb_get_device_descriptor(device, &descriptor);
  return {descriptor.idVendor, descriptor.idProduct, "", port_path(device), true, is_instrument(device)};
}

std::string serial_of(libusb_device* device, libusb_device_handle* handle) {
  libusb_device_descriptor descriptor{};
  libusb_get_device_descriptor(device, &descriptor);
  if (descriptor.iSerialNumber == 0) return "";
  std::array<unsigned char, 256> text{};
  const int n = libusb_get_string_descriptor_ascii(handle, descriptor.iSerialNumber, text.data(), text.size());
  return n > 0 ? std::string(text.begin(), text.begin() + n) : "";
}

/// The serial number can be asked only of an open device.
Listing listing_of(libusb_device* device) {
  Listing listing = listing_without_serial(device);
  libusb_device_handle* handle = nullptr;
  listing.readable = libusb_open(device, &handle) == 0;
  if (!listing.readable) return listing;
  listing.serial = serial_of(device, handle);
  libusb_close(handle);
  return listing;
}

/// The devices of a moment, referenced.
class Snapshot {
 public:
  explicit Snapshot(libusb_context* context) : count_(libusb_get_device_list(context, &devices_)) {}
  ~Snapshot() {
    if (count_ >= 0) libusb_free_device_list(devices_, 1);
  }
  Snapshot(const Snapshot&) = delete;
  Snapshot& operator=(const Snapshot&) = delete;
  [[nodiscard]] libusb_device** begin() const noexcept { return devices_; }
  [[nodiscard]] libusb_device** end() const noexcept { return devices_ + (count_ < 0 ? 0 : count_); }

 private:
  libusb_device** devices_ = nullptr;
  ssize_t count_;
};

}  // namespace

Bus::Bus() {
  if (const int error = libusb_init(&context_); error != 0)
    throw DeviceError("USB", "start", libusb_error_name(error), "check that /dev/bus/usb is mounted");
  thread_ = start_thread([this] { handle_events(); });
}

Bus::~Bus() {
  stopping_ = true;
  libusb_interrupt_event_handler(context_);
  thread_.join();
  libusb_exit(context_);
}

std::vector<Listing> Bus::list() const {
  std::vector<Listing> listings;
  for (libusb_device* device : Snapshot(context_)) listings.push_back(listing_of(device));
  return listings;
}

std::unique_ptr<Transport> Bus::open(const UsbAddress& address) const {
  const std::string device_name = "USB device " + address.text();
  const Snapshot snapshot(context_);
  libusb_device* chosen = nullptr;
  Listing listing;
  std::string candidates;
  int count = 0;
  for (libusb_device* device : snapshot) {
    Listing found = listing_without_serial(device);
    if (!UsbAddress{address.vendor, address.product, "", ""}.fits(found.vendor, found.product, "")) continue;
    found = listing_of(device);
    if (!found.readable && address.vendor && address.product && address.serial != found.serial)
      throw DeviceError(device_name, "open", "this user may not open " + to_string(found), kRule);
    if (!fits(address, found)) continue;
    candidates += (count++ == 0 ? "" : "; ") + to_string(found);
    chosen = device;
    listing = found;
  }
  if (count == 0) throw DeviceError(device_name, "open", "not plugged in", "see the list of `kphi devices`");
  if (count > 1) {
    throw DeviceError(device_name, "open", "several fit: " + candidates,
                      "add the serial number (:SERIAL) or the socket (@PORT)");
  }
  libusb_device_handle* handle = nullptr;
  if (const int error = libusb_open(chosen, &handle); error != 0)
    throw DeviceError(device_name, "open", libusb_error_name(error), error == LIBUSB_ERROR_ACCESS ? kRule : "");
  return std::make_unique<Device>(handle, listing);
}

void Bus::handle_events() noexcept {
  while (!stopping_) {
    timeval patience{1, 0};
    libusb_handle_events_timeout_completed(context_, &patience, nullptr);
  }
}

}  // namespace kphi::usb
