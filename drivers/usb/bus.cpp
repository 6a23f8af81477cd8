#include "drivers/usb/bus.hpp"

#include <fmt/format.h>
#include <libusb.h>

#include <array>

#include "base/error.hpp"
#include "base/thread.hpp"
#include "drivers/usb/device.hpp"

namespace kphi::usb {
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
