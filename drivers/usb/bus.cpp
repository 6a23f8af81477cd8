#include "drivers/usb/bus.hpp"

#include <fmt/format.h>
#include <libusb.h>

#include <algorithm>
#include <array>

#include "base/error.hpp"

namespace kphi::usb {
namespace {

constexpr const char* kRule = "install drivers/udev/60-kphi.rules, or run as a member of the device's group";
constexpr std::uint8_t kApplication = 0xFE, kTestAndMeasurement = 0x03;

EndpointKind kind_of(std::uint8_t attributes) noexcept {
  const int type = attributes & LIBUSB_TRANSFER_TYPE_MASK;
  if (type == LIBUSB_TRANSFER_TYPE_BULK) return EndpointKind::bulk;
  return type == LIBUSB_TRANSFER_TYPE_INTERRUPT ? EndpointKind::interrupt : EndpointKind::other;
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

Outcome outcome_of(int error) noexcept {
  if (error == 0) return Outcome::done;
  if (error == LIBUSB_ERROR_NO_DEVICE) return Outcome::gone;
  if (error == LIBUSB_ERROR_PIPE) return Outcome::stalled;
  return error == LIBUSB_ERROR_TIMEOUT ? Outcome::timed_out : Outcome::failed;
}

class Device final : public Transport {
 public:
  /// Takes over an open handle, reads the descriptors.
  Device(libusb_device_handle* handle, const Listing& listing)
      : handle_(handle),
        listing_(listing),
        name_("USB device " + to_string(listing)),
        interfaces_(interfaces_of(libusb_get_device(handle))) {
    libusb_set_auto_detach_kernel_driver(handle_, 1);
  }
  /// Releases the interfaces, to the kernel's driver too.
  ~Device() override {
    for (const std::uint8_t number : claimed_) libusb_release_interface(handle_, number);
    libusb_close(handle_);
  }

  const std::string& name() const noexcept override { return name_; }
  std::string device_file() const override {
    libusb_device* device = libusb_get_device(handle_);
    return fmt::format("/dev/bus/usb/{:03}/{:03}", libusb_get_bus_number(device), libusb_get_device_address(device));
  }
  std::uint16_t vendor() const noexcept override { return listing_.vendor; }
  std::uint16_t product() const noexcept override { return listing_.product; }
  const std::vector<Interface>& interfaces() const noexcept override { return interfaces_; }

  void claim(std::uint8_t interface_number) override {
    if (const int error = libusb_claim_interface(handle_, interface_number); error != 0) {
      throw DeviceError(name_, "claim its interface",
                        error == LIBUSB_ERROR_BUSY ? "another program uses it" : libusb_error_name(error),
                        "close the other program, or plug the device in again");
    }
    claimed_.push_back(interface_number);
  }

  Transfer control_in(const Setup& setup, std::span<std::uint8_t> data, Timeout timeout) noexcept override {
    const int n =
        libusb_control_transfer(handle_, setup.request_type, setup.request, setup.value, setup.index, data.data(),
                                static_cast<std::uint16_t>(data.size()), static_cast<unsigned>(timeout.count()));
    return n < 0 ? Transfer{outcome_of(n)} : Transfer{Outcome::done, static_cast<std::size_t>(n)};
  }
  Transfer read(const Endpoint& endpoint, std::span<std::uint8_t> data, Timeout timeout) noexcept override {
    return move(endpoint, data.data(), data.size(), timeout);
  }
  Transfer write(const Endpoint& endpoint, std::span<const std::uint8_t> data, Timeout timeout) noexcept override {
    return move(endpoint, const_cast<std::uint8_t*>(data.data()), data.size(), timeout);
  }
  Outcome clear_halt(const Endpoint& endpoint) noexcept override {
    return outcome_of(libusb_clear_halt(handle_, endpoint.address));
  }

 private:
  Transfer move(const Endpoint& endpoint, std::uint8_t* data, std::size_t size, Timeout timeout) noexcept {
    const auto transfer = endpoint.kind == EndpointKind::interrupt ? libusb_interrupt_transfer : libusb_bulk_transfer;
    int bytes = 0;
    const int error = transfer(handle_, endpoint.address, data, static_cast<int>(size), &bytes,
                               static_cast<unsigned>(timeout.count()));
    return {outcome_of(error), static_cast<std::size_t>(bytes)};
  }

  libusb_device_handle* handle_;
  const Listing listing_;
  const std::string name_;
  const std::vector<Interface> interfaces_;
  std::vector<std::uint8_t> claimed_;
};

std::string port_path(libusb_device* device) {
  std::array<std::uint8_t, 7> ports{};  // USB 3.0: seven tiers at most
  const int n = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  std::string path = fmt::format("{}", libusb_get_bus_number(device));
  for (int i = 0; i < n; ++i) path += fmt::format("{}{}", i == 0 ? '-' : '.', ports[static_cast<std::size_t>(i)]);
  return path;
}

libusb_device_descriptor descriptor_of(libusb_device* device) {
  libusb_device_descriptor descriptor{};
  libusb_get_device_descriptor(device, &descriptor);
  return descriptor;
}

Listing listing_without_serial(libusb_device* device) {
  const libusb_device_descriptor descriptor = descriptor_of(device);
  const std::vector<Interface> all = interfaces_of(device);
  const bool instrument = std::ranges::any_of(
      all, [](const Interface& one) { return one.class_code == kApplication && one.subclass == kTestAndMeasurement; });
  return {descriptor.idVendor, descriptor.idProduct, "", port_path(device), true, instrument};
}

/// The serial number can be asked only of an open device.
Listing listing_of(libusb_device* device) {
  Listing listing = listing_without_serial(device);
  libusb_device_handle* handle = nullptr;
  listing.readable = libusb_open(device, &handle) == 0;
  if (!listing.readable) return listing;
  std::array<unsigned char, 256> text{};
  const std::uint8_t index = descriptor_of(device).iSerialNumber;
  const int n = index == 0 ? 0 : libusb_get_string_descriptor_ascii(handle, index, text.data(), text.size());
  listing.serial.assign(text.begin(), text.begin() + std::max(n, 0));
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

const char* name_of(Outcome outcome) noexcept {
  constexpr const char* names[] = {"done", "no answer in time", "the endpoint stalled", "the device was unplugged",
                                   "the transfer failed"};
  return names[static_cast<int>(outcome)];
}

bool fits(const UsbAddress& wanted, const Listing& found) noexcept {
  return wanted.fits(found.vendor, found.product, found.serial) &&
         (wanted.port_path.empty() || wanted.port_path == found.port_path);
}

std::string to_string(const Listing& l) {
  return fmt::format("{:04x}:{:04x}{}{}, port {}{}", l.vendor, l.product, l.serial.empty() ? "" : ", serial ", l.serial,
                     l.port_path, l.readable ? "" : " (not readable by this user)");
}

Bus::Bus() {
  if (const int error = libusb_init(&context_); error != 0)
    throw DeviceError("USB", "start", libusb_error_name(error), "check that /dev/bus/usb is mounted");
}

Bus::~Bus() { libusb_exit(context_); }

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

}  // namespace kphi::usb
