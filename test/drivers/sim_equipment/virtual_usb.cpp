#include "test/drivers/sim_equipment/virtual_usb.hpp"

#include <dlfcn.h>
#include <errno.h>
#include <fmt/format.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <umockdev.h>

#include <algorithm>
#include <list>
#include <map>
#include <mutex>
#include <stdexcept>
#include <utility>

namespace kphi::sim {
namespace {

constexpr std::uint8_t kGetDescriptor = 6, kClearFeature = 1, kIn = 0x80;

struct Unref {
  void operator()(void* object) const noexcept { g_object_unref(object); }
};
template <class Object>
using Owned = std::unique_ptr<Object, Unref>;

struct UnrefData {
  void operator()(UMockdevIoctlData* data) const noexcept { umockdev_ioctl_data_unref(data); }
};
using Data = std::unique_ptr<UMockdevIoctlData, UnrefData>;

/// None where the program was killed during its call.
Data resolve(UMockdevIoctlData* data, std::size_t offset, std::size_t bytes) {
  return Data(umockdev_ioctl_data_resolve(data, offset, bytes, nullptr));
}

[[noreturn]] void throw_and_free(const std::string& what, GError* error) {
  const std::string message = what + (error != nullptr ? std::string(": ") + error->message : "");
  if (error != nullptr) g_error_free(error);
  throw std::runtime_error(message);
}

/// A request of the host that is under way. It belongs to whoever opened the device, as in the kernel: a program that
/// was killed must not leave its requests to the next one.
struct Urb {
  Owned<UMockdevIoctlClient> client;
  Data data;    // struct usbdevfs_urb
  Data buffer;  // what it points to
  [[nodiscard]] usbdevfs_urb& operator*() const noexcept { return *reinterpret_cast<usbdevfs_urb*>(data->data); }
  [[nodiscard]] std::span<std::uint8_t> bytes() const noexcept {
    return buffer ? std::span(buffer->data, static_cast<std::size_t>((**this).buffer_length))
                  : std::span<std::uint8_t>();
  }
  bool ended = false;
};

void append16(std::vector<std::uint8_t>& bytes, std::size_t value) {
  bytes.push_back(static_cast<std::uint8_t>(value));
  bytes.push_back(static_cast<std::uint8_t>(value >> 8));
}

/// Device and configuration descriptor, as the kernel shows them in sysfs (USB 2.0, 9.6).
std::vector<std::uint8_t> descriptors_of(const UsbShape& shape) {
  std::vector<std::uint8_t> device{18, 1, 0x00, 0x02, 0, 0, 0, 64};
  append16(device, shape.vendor);
  append16(device, shape.product);
  append16(device, 0x0100);
  device.insert(device.end(), {1, 2, static_cast<std::uint8_t>(shape.serial.empty() ? 0 : 3), 1});

  std::vector<std::uint8_t> inner;
  for (std::size_t i = 0; i < shape.interfaces.size(); ++i) {
    const UsbInterfaceShape& one = shape.interfaces[i];
    const auto endpoints = static_cast<std::uint8_t>(one.endpoints.size());
    inner.insert(inner.end(),
                 {9, 4, static_cast<std::uint8_t>(i), 0, endpoints, one.class_code, one.subclass, one.protocol, 0});
    for (const UsbEndpointShape& endpoint : one.endpoints) {
      inner.insert(inner.end(), {7, 5, endpoint.address, endpoint.attributes});
      append16(inner, endpoint.packet_bytes);
      inner.push_back(1);
    }
  }
  std::vector<std::uint8_t> configuration{9, 2};
  append16(configuration, 9 + inner.size());
  configuration.insert(configuration.end(), {static_cast<std::uint8_t>(shape.interfaces.size()), 1, 0, 0x80, 50});

  device.insert(device.end(), configuration.begin(), configuration.end());
  device.insert(device.end(), inner.begin(), inner.end());
  return device;
}

/// UTF-16LE, as in a string descriptor; ASCII only.
std::vector<std::uint8_t> string_descriptor(const std::string& text) {
  std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), 3};
  for (const char c : text) bytes.insert(bytes.end(), {static_cast<std::uint8_t>(c), 0});
  return bytes;
}

}  // namespace

/// One device in its socket; answers the kernel's calls on umockdev's thread.
class VirtualUsb::Socket {
 public:
  /// `number`: of the device on its bus, another one for each stay, as the kernel does it.
  Socket(UMockdevTestbed* bed, int port, int number, UsbFunction& function)
      : bed_(bed), function_(function), number_(number) {
    node_ = fmt::format("/dev/bus/usb/001/{:03}", number_);
    path_ = fmt::format("/sys/devices/usb1/1-{}", port);
    GError* error = nullptr;
    handler_.reset(umockdev_ioctl_base_new());
    g_signal_connect(handler_.get(), "handle-ioctl", G_CALLBACK(&Socket::on_ioctl), this);
    // Before the device is seen: umockdev ends a program that opens one whose calls it cannot answer yet.
    if (umockdev_testbed_attach_ioctl(bed_, node_.c_str(), handler_.get(), &error) == 0)
      throw_and_free("virtual USB: attach a device", error);
    if (umockdev_testbed_add_from_string(bed_, description(port).c_str(), &error) == 0)
      throw_and_free("virtual USB: add a device", error);
    umockdev_testbed_uevent(bed_, path_.c_str(), "add");
  }
  ~Socket() {
    pull();
    umockdev_testbed_detach_ioctl(bed_, node_.c_str(), nullptr);
  }
  /// From now on its calls are answered as those of a device that is gone, after the transfers under way have ended as
  /// such. Who detached it right away would leave a call that is under way without any answer, for ever.
  void pull() {
    {
      const std::lock_guard lock(mutex_);
      if (std::exchange(gone_, true)) return;
    }
    umockdev_testbed_uevent(bed_, path_.c_str(), "remove");
    umockdev_testbed_remove_device(bed_, path_.c_str());
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

 private:
  [[nodiscard]] std::string description(int port) const {
    std::string hex;
    for (const std::uint8_t byte : descriptors_of(function_.shape())) hex += fmt::format("{:02x}", byte);
    return fmt::format(
        "P: /devices/usb1/1-{0}\n"
        "N: bus/usb/001/{1:03}\n"
        "E: SUBSYSTEM=usb\nE: DRIVER=usb\nE: BUSNUM=001\nE: DEVNUM={1:03}\n"
        "E: DEVNAME=/dev/bus/usb/001/{1:03}\nE: DEVTYPE=usb_device\n"
        "A: bConfigurationValue=1\\n\nA: busnum=1\\n\nA: devnum={1}\\n\nA: devpath={0}\\n\nA: speed=480\\n\n"
        "A: idVendor={2:04x}\\n\nA: idProduct={3:04x}\\n\n"
        "H: descriptors={4}\n",
        port, number_, function_.shape().vendor, function_.shape().product, hex);
  }

  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer socket) {
    return static_cast<Socket*>(socket)->answer(client);
  }

  gboolean answer(UMockdevIoctlClient* client) {
    const std::lock_guard lock(mutex_);
    UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
    const gulong request = umockdev_ioctl_client_get_request(client);
    const auto complete = [&](glong result, int error) {
      umockdev_ioctl_client_complete(client, result, error);
      return TRUE;
    };
    const auto mine = [&](const Urb& urb) { return urb.client.get() == client; };
    const bool reaps = request == USBDEVFS_REAPURB || request == USBDEVFS_REAPURBNDELAY;
    if (gone_ && !(reaps && std::any_of(urbs_.begin(), urbs_.end(), mine))) return complete(-1, ENODEV);
    switch (request) {
      case USBDEVFS_GET_CAPABILITIES: {
        const Data flags = resolve(argument, 0, sizeof(std::uint32_t));
        if (!flags) return complete(-1, EFAULT);
        const std::uint32_t capabilities =
            USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
        umockdev_ioctl_data_update(flags.get(), 0,
                                   const_cast<std::uint8_t*>(reinterpret_cast<const std::uint8_t*>(&capabilities)),
                                   sizeof capabilities);
        return complete(0, 0);
      }
      case USBDEVFS_GETDRIVER:
        return complete(-1, ENODATA);
      case USBDEVFS_IOCTL:  // detach or attach the kernel's driver: there is none
        return complete(-1, ENODATA);
      case USBDEVFS_RELEASEINTERFACE:
        std::this_thread::sleep_for(function_.release_takes());
        return complete(0, 0);
      case USBDEVFS_CLAIMINTERFACE:
      case USBDEVFS_SETINTERFACE:
      case USBDEVFS_RESET:
      case USBDEVFS_DISCONNECT_CLAIM:
        return complete(0, 0);
      case USBDEVFS_CLEAR_HALT: {
        const Data endpoint = resolve(argument, 0, sizeof(unsigned));
        if (!endpoint) return complete(-1, EFAULT);
        function_.halt_cleared(endpoint->data[0]);
        return complete(0, 0);
      }
      case USBDEVFS_SUBMITURB:
        return submit(client, argument) ? complete(0, 0) : complete(-1, EFAULT);
      case USBDEVFS_REAPURB:
      case USBDEVFS_REAPURBNDELAY: {
        const auto ended = next_ended(mine);
        if (ended == urbs_.end()) return complete(-1, EAGAIN);
        const Data pointer = resolve(argument, 0, sizeof(void*));
        if (!pointer) return complete(-1, EFAULT);
        umockdev_ioctl_data_set_ptr(pointer.get(), 0, ended->data.get());
        urbs_.erase(ended);
        return complete(0, 0);
      }
      case USBDEVFS_DISCARDURB: {
        const gulong address = *reinterpret_cast<gulong*>(argument->data);
        const auto found = std::find_if(urbs_.begin(), urbs_.end(),
                                        [&](const Urb& urb) { return mine(urb) && urb.data->client_addr == address; });
        if (found == urbs_.end()) return complete(-1, EINVAL);
        if (!found->ended) end(*found, -ENOENT, 0);
        return complete(0, 0);
      }
      default:
        return complete(-1, ENOTTY);
    }
  }

  [[nodiscard]] bool submit(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
    Urb urb;
    urb.client.reset(UMOCKDEV_IOCTL_CLIENT(g_object_ref(client)));
    urb.data = resolve(argument, 0, sizeof(usbdevfs_urb));
    if (!urb.data) return false;
    const auto length = static_cast<std::size_t>((*urb).buffer_length);
    if (length > 0) urb.buffer = resolve(urb.data.get(), offsetof(usbdevfs_urb, buffer), length);
    urbs_.push_back(std::move(urb));
    carry_on(urbs_.back());
    return true;
  }

  template <class Mine>
  std::list<Urb>::iterator next_ended(const Mine& mine) {
    for (Urb& urb : urbs_) {
      if (urb.ended || !mine(urb)) continue;
      gone_ ? end(urb, -ESHUTDOWN, 0) : carry_on(urb);
    }
    return std::find_if(urbs_.begin(), urbs_.end(), [&](const Urb& urb) { return urb.ended && mine(urb); });
  }

  void carry_on(Urb& urb) {
    if ((*urb).type == USBDEVFS_URB_TYPE_CONTROL) return control(urb);
    const std::uint8_t endpoint = (*urb).endpoint;
    if ((endpoint & kIn) == 0) {
      const UsbAnswer answer = function_.out(endpoint, urb.bytes());
      if (answer.kind == UsbAnswer::Kind::nothing_yet) return;
      return answer.kind == UsbAnswer::Kind::stall ? end(urb, -EPIPE, 0) : end(urb, 0, urb.bytes().size());
    }
    give(urb, function_.in(endpoint, urb.bytes().size()), urb.bytes());
  }

  void control(Urb& urb) {
    const auto b = urb.bytes();
    if (b.size() < 8) return end(urb, -EPIPE, 0);
    const auto u16 = [&](std::size_t at) { return static_cast<std::uint16_t>(b[at] | b[at + 1] << 8); };
    const UsbSetup setup{b[0], b[1], u16(2), u16(4), u16(6)};
    const auto data = b.subspan(8);
    if (setup.request_type == kIn && setup.request == kGetDescriptor)
      return give(urb, standard_descriptor(setup.value), data);
    if (setup.request_type == 0x02 && setup.request == kClearFeature) {
      function_.halt_cleared(static_cast<std::uint8_t>(setup.index));
      return end(urb, 0, 0);
    }
    const bool in = (setup.request_type & kIn) != 0;
    const UsbAnswer answer = function_.control(setup, in ? std::span<const std::uint8_t>() : data);
    if (in) return give(urb, answer, data);
    if (answer.kind != UsbAnswer::Kind::nothing_yet)
      answer.kind == UsbAnswer::Kind::stall ? end(urb, -EPIPE, 0) : end(urb, 0, data.size());
  }

  [[nodiscard]] UsbAnswer standard_descriptor(std::uint16_t value) const {
    const UsbShape& shape = function_.shape();
    if (value >> 8 != 3) return {UsbAnswer::Kind::stall, {}};
    switch (value & 0xFF) {
      case 0:
        return {UsbAnswer::Kind::bytes, {4, 3, 0x09, 0x04}};
      case 1:
        return {UsbAnswer::Kind::bytes, string_descriptor(shape.manufacturer)};
      case 2:
        return {UsbAnswer::Kind::bytes, string_descriptor(shape.product_name)};
      case 3:
        return {UsbAnswer::Kind::bytes, string_descriptor(shape.serial)};
      default:
        return {UsbAnswer::Kind::stall, {}};
    }
  }

  static void give(Urb& urb, const UsbAnswer& answer, std::span<std::uint8_t> into) {
    if (answer.kind == UsbAnswer::Kind::nothing_yet) return;
    if (answer.kind == UsbAnswer::Kind::stall) return end(urb, -EPIPE, 0);
    if (answer.bytes.size() > into.size()) return end(urb, -EOVERFLOW, 0);
    std::copy(answer.bytes.begin(), answer.bytes.end(), into.begin());
    if (urb.buffer)
      umockdev_ioctl_data_update(urb.buffer.get(), 0, urb.buffer->data, static_cast<gint>(urb.bytes().size()));
    end(urb, 0, answer.bytes.size());
  }

  static void end(Urb& urb, int status, std::size_t bytes) {
    (*urb).status = status;
    (*urb).actual_length = static_cast<int>(bytes);
    umockdev_ioctl_data_update(urb.data.get(), 0, urb.data->data, sizeof(usbdevfs_urb));
    urb.ended = true;
  }

  UMockdevTestbed* bed_;
  UsbFunction& function_;
  const int number_;
  std::string node_, path_;
  Owned<UMockdevIoctlBase> handler_;
  std::mutex mutex_;
  bool gone_ = false;
  std::list<Urb> urbs_;
};

struct VirtualUsb::Bed {
  Owned<UMockdevTestbed> testbed{umockdev_testbed_new()};
  std::mutex mutex;  // of all below: whoever plugs
  std::map<int, std::unique_ptr<Socket>> sockets;
  std::vector<std::unique_ptr<Socket>> pulled;
  int devices = 1;  // so far, with the root hub

  void pull(int port) {
    const auto found = sockets.find(port);
    if (found == sockets.end()) return;
    found->second->pull();
    pulled.push_back(std::move(found->second));
    sockets.erase(found);
  }
};

VirtualUsb::VirtualUsb() : bed_(std::make_unique<Bed>()) {
  if (umockdev_in_mock_environment() == 0)
    throw std::runtime_error("virtual USB: start this program under umockdev-wrapper (package umockdev)");
}

VirtualUsb::~VirtualUsb() = default;

bool VirtualUsb::available() noexcept {
  void* const preloaded = dlopen("libumockdev-preload.so.0", RTLD_LAZY | RTLD_NOLOAD);
  if (preloaded != nullptr) dlclose(preloaded);
  return preloaded != nullptr;
}

void VirtualUsb::plug(int port, UsbFunction& function) {
  const std::lock_guard lock(bed_->mutex);
  bed_->pull(port);
  bed_->sockets[port] = std::make_unique<Socket>(bed_->testbed.get(), port, ++bed_->devices, function);
}

void VirtualUsb::unplug(int port) {
  const std::lock_guard lock(bed_->mutex);
  bed_->pull(port);
}

std::string VirtualUsb::directory() const {
  gchar* root = umockdev_testbed_get_root_dir(bed_->testbed.get());
  std::string directory = root;
  g_free(root);
  return directory;
}

}  // namespace kphi::sim
