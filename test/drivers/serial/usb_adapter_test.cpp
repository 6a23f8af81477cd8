// Discovery and port together, on a system whose USB bus is made by libumockdev in user space.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <umockdev.h>

#include <array>
#include <chrono>
#include <memory>

#include "base/error.hpp"
#include "drivers/serial/port.hpp"

namespace kphi::serial {
namespace usb_adapter_test {

using testing::HasSubstr;

constexpr const char* kBus =
    "P: /devices/pci0/usb1\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\nA: idVendor=1d6b\\n\nA: idProduct=0002\\n\n";

/// The adapter as udev would describe it: device, interface, port, terminal.
std::string adapter(const std::string& socket, const std::string& ids, const std::string& serial,
                    const std::string& terminal) {
  const std::string device = "/devices/pci0/usb1/" + socket;
  const std::string interface = device + "/" + socket + ":1.0";
  return "P: " + device + "\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\nA: idVendor=" + ids.substr(0, 4) +
         "\\n\nA: idProduct=" + ids.substr(5) + "\\n\n" + (serial.empty() ? "" : "A: serial=" + serial + "\\n\n") +
         "A: manufacturer=FTDI\\n\nA: product=FT232R USB UART\\n\n\nP: " + interface +
         "\nE: DEVTYPE=usb_interface\nE: SUBSYSTEM=usb\nA: bInterfaceNumber=00\\n\n\nP: " + interface + "/" + terminal +
         "\nE: SUBSYSTEM=usb-serial\nA: latency_timer=16\\n\n\nP: " + interface + "/" + terminal + "/tty/" + terminal +
         "\nN: " + terminal + "\nE: DEVNAME=/dev/" + terminal + "\nE: SUBSYSTEM=tty\n";
}

/// libumockdev knows TIOCEXCL no more than any other call of terminals: it is granted here.
gboolean grant(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer) {
  const auto request = umockdev_ioctl_client_get_request(client);
  if (request != TIOCEXCL && request != TIOCNXCL) return FALSE;
  umockdev_ioctl_client_complete(client, 0, 0);
  return TRUE;
}

struct Release {
  void operator()(gpointer object) const { g_object_unref(object); }
};

class UsbAdapterOnAFakeBus : public testing::Test {
 protected:
  void SetUp() override {
    // The test bed must exist before the question whether there is one: the answer is remembered.
    bed_.reset(umockdev_testbed_new());
    if (!umockdev_in_mock_environment()) GTEST_SKIP() << "libumockdev-preload.so.0 is not loaded before the program";
    add(kBus);
  }
  void add(const std::string& description) {
    GError* error = nullptr;
    ASSERT_TRUE(umockdev_testbed_add_from_string(bed_.get(), description.c_str(), &error))
        << (error != nullptr ? error->message : "");
  }
  void let_open_exclusively(const char* device) {
    ioctls_.reset(umockdev_ioctl_base_new());
    g_signal_connect(ioctls_.get(), "handle-ioctl", G_CALLBACK(grant), nullptr);
    GError* error = nullptr;
    ASSERT_TRUE(umockdev_testbed_attach_ioctl(bed_.get(), device, ioctls_.get(), &error));
  }
  std::unique_ptr<UMockdevTestbed, Release> bed_;
  std::unique_ptr<UMockdevIoctlBase, Release> ioctls_;
};

TEST_F(UsbAdapterOnAFakeBus, IsFoundByItsSerialNumberAndCarriesBytes) {
  add(adapter("1-1", "0403:6001", "A10K0000", "ttyUSB0"));
  add(adapter("1-2", "0403:6001", "B20L1111", "ttyUSB1"));
  let_open_exclusively("/dev/ttyUSB1");
  Port port("usb:*:*:B20L1111", 115200);
  EXPECT_EQ(port.device(), "/dev/ttyUSB1");
  const int far_end = umockdev_testbed_get_dev_fd(bed_.get(), "/dev/ttyUSB1");
  ASSERT_GE(far_end, 0);
  const std::array<std::uint8_t, 3> asked{'a', 's', 'k'};
  ASSERT_EQ(port.write(asked), asked.size());
  std::string heard(3, ' ');
  ASSERT_EQ(::read(far_end, heard.data(), 3), 3);
  EXPECT_EQ(heard, "ask");
  ASSERT_EQ(::write(far_end, "tell", 4), 4);
  std::string got;
  while (got.size() < 4 && port.wait(std::chrono::seconds(10))) {
    std::array<std::uint8_t, 16> bytes;
    const std::size_t n = port.read(bytes);
    got.append(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n));
  }
  EXPECT_EQ(got, "tell");
}

TEST_F(UsbAdapterOnAFakeBus, TellsItsLatencyTimerAndItsSocket) {
  add(adapter("1-1", "0403:6001", "A10K0000", "ttyUSB0"));
  const auto found = adapter_of("/dev/ttyUSB0");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->line(), "/dev/ttyUSB0 is usb:0403:6001:A10K0000 (FTDI FT232R USB UART) in socket 1-1:1.0");
  EXPECT_EQ(found->latency_timer_ms, 16);
  EXPECT_TRUE(judge_latency_timer(*found));
}

TEST_F(UsbAdapterOnAFakeBus, IsMissedOnceItIsUnplugged) {
  add(adapter("1-1", "0403:6001", "A10K0000", "ttyUSB0"));
  EXPECT_EQ(path_of("usb:0403:6001"), "/dev/ttyUSB0");
  umockdev_testbed_remove_device(bed_.get(), "/sys/devices/pci0/usb1/1-1");
  EXPECT_THAT([&] { (void)path_of("usb:0403:6001"); },
              testing::ThrowsMessage<DeviceError>(HasSubstr("no USB serial adapter is plugged in")));
}

}  // namespace usb_adapter_test
}  // namespace kphi::serial
