// The true libusb against devices of our own on a virtual bus.
#include "drivers/usb/bus.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <mutex>
#include <thread>

#include "test/drivers/usb/virtual_bus.hpp"

namespace kphi::usb {
namespace bus_test {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

/// Gives back on an IN endpoint what came on an OUT endpoint; says nothing before something came.
class Echo final : public sim::UsbFunction {
 public:
  explicit Echo(std::string serial) {
    shape_ = {0x1209,
              0x0001,
              "kphi",
              "echo",
              std::move(serial),
              {{0xFF, 1, 2, {{0x01, 2, 512}, {0x82, 2, 512}}}, {0xFF, 1, 3, {{0x03, 3, 64}, {0x83, 3, 64}}}}};
  }
  const sim::UsbShape& shape() const noexcept override { return shape_; }
  sim::UsbAnswer control(const sim::UsbSetup& setup, std::span<const std::uint8_t>) override {
    if (setup.request == 1) return {sim::UsbAnswer::Kind::bytes, {1, 2, 3}};
    return {sim::UsbAnswer::Kind::stall, {}};
  }
  sim::UsbAnswer out(std::uint8_t, std::span<const std::uint8_t> bytes) override {
    const std::lock_guard lock(mutex_);
    echoes_.emplace_back(bytes.begin(), bytes.end());
    return {};
  }
  sim::UsbAnswer in(std::uint8_t, std::size_t) override {
    const std::lock_guard lock(mutex_);
    if (halted) return {sim::UsbAnswer::Kind::stall, {}};
    if (echoes_.empty()) return {sim::UsbAnswer::Kind::nothing_yet, {}};
    auto bytes = echoes_.front();
    echoes_.pop_front();
    return {sim::UsbAnswer::Kind::bytes, bytes};
  }
  void halt_cleared(std::uint8_t) override { halted = false; }
  std::atomic<bool> halted{false};

 private:
  sim::UsbShape shape_;
  std::mutex mutex_;
  std::deque<std::vector<std::uint8_t>> echoes_;
};

class VirtualBusTest : public OnVirtualBus {
 protected:
  const Endpoint& endpoint(const Transport& device, std::uint8_t address) {
    for (const Interface& candidates : device.interfaces())
      for (const Endpoint& candidate : candidates.endpoints)
        if (candidate.address == address) return candidate;
    throw std::logic_error("no such endpoint");
  }
  std::string refusal(const Bus& on, const char* address) {
    return kphi::refusal([&] { (void)on.open(UsbAddress::parse(address)); });
  }

  std::unique_ptr<Transport> opened() {
    wire->plug(1, one);
    bus = std::make_unique<Bus>();
    return bus->open(UsbAddress::parse("usb:1209:0001"));
  }

  Echo one{"0001"}, two{"0002"};
  std::unique_ptr<Bus> bus;
};

TEST_F(VirtualBusTest, IsEmptyWithoutDevices) {
  const Bus empty;
  EXPECT_TRUE(empty.list().empty());
  EXPECT_THAT(refusal(empty, "usb:1209:0001"), HasSubstr("not plugged in"));
}

TEST_F(VirtualBusTest, ListsWhatIsThereAndRefusesToGuessBetweenTwoAlike) {
  wire->plug(1, one);
  wire->plug(4, two);
  const Bus here;
  EXPECT_THAT(here.list(), testing::UnorderedElementsAre(Listing{0x1209, 1, "0001", "1-1", true},
                                                         Listing{0x1209, 1, "0002", "1-4", true}));
  EXPECT_THAT(refusal(here, "usb:1209:0001"),
              testing::AllOf(HasSubstr("several fit"), HasSubstr("0001"), HasSubstr("0002")));
  EXPECT_THAT(here.open(UsbAddress::parse("usb:1209:0001:0002"))->name(), HasSubstr("port 1-4"));
  EXPECT_THAT(here.open(UsbAddress::parse("usb:1209:0001@1-1"))->name(), HasSubstr("serial 0001"));
}

TEST_F(VirtualBusTest, ReadsTheDescriptors) {
  const auto device = opened();
  ASSERT_EQ(device->interfaces().size(), 2u);
  const Interface& first = device->interfaces()[0];
  EXPECT_EQ(first.class_code, 0xFF);
  EXPECT_EQ(first.subclass, 1);
  EXPECT_EQ(first.protocol, 2);
  ASSERT_EQ(first.endpoints.size(), 2u);
  EXPECT_EQ(first.endpoints[1].address, 0x82);
  EXPECT_TRUE(first.endpoints[1].in());
  EXPECT_EQ(first.endpoints[1].kind, EndpointKind::bulk);
  EXPECT_EQ(first.endpoints[1].packet_bytes, 512);
  EXPECT_EQ(device->interfaces()[1].endpoints[0].kind, EndpointKind::interrupt);
}

TEST_F(VirtualBusTest, MovesControlBulkAndInterruptTransfers) {
  const auto device = opened();
  device->claim(0);
  device->claim(1);
  std::array<std::uint8_t, 8> data{};
  Transfer got = device->control_in({0xC0, 1, 0, 0}, data, 1000ms);
  EXPECT_EQ(got.outcome, Outcome::done);
  EXPECT_EQ(got.bytes, 3u);
  EXPECT_THAT(std::span(data).first(3), ElementsAre(1, 2, 3));
  EXPECT_EQ(device->control_in({0xC0, 77, 0, 0}, data, 1000ms).outcome, Outcome::stalled);

  for (const auto& [out, in] : {std::pair{0x01, 0x82}, std::pair{0x03, 0x83}}) {
    const std::array<std::uint8_t, 5> sent{5, 4, 3, 2, 1};
    EXPECT_EQ(device->write(endpoint(*device, static_cast<std::uint8_t>(out)), sent, 1000ms).bytes, 5u);
    got = device->read(endpoint(*device, static_cast<std::uint8_t>(in)), data, 1000ms);
    EXPECT_EQ(got.outcome, Outcome::done);
    EXPECT_EQ(got.bytes, 5u);
    EXPECT_THAT(std::span(data).first(5), ElementsAre(5, 4, 3, 2, 1));
  }
}

TEST_F(VirtualBusTest, ReportsAStallAndClearsIt) {
  const auto device = opened();
  device->claim(0);
  std::array<std::uint8_t, 8> data{};
  one.halted = true;
  EXPECT_EQ(device->read(endpoint(*device, 0x82), data, 1000ms).outcome, Outcome::stalled);
  EXPECT_EQ(device->clear_halt(endpoint(*device, 0x82)), Outcome::done);
  const std::array<std::uint8_t, 1> sent{5};
  device->write(endpoint(*device, 0x01), sent, 1000ms);
  EXPECT_EQ(device->read(endpoint(*device, 0x82), data, 1000ms).outcome, Outcome::done);
}

TEST_F(VirtualBusTest, GivesUpInTime) {
  const auto device = opened();
  device->claim(0);
  std::array<std::uint8_t, 8> data{};
  EXPECT_EQ(device->read(endpoint(*device, 0x82), data, 50ms).outcome, Outcome::timed_out);
}

TEST_F(VirtualBusTest, EndsATransferWhenItsDeviceIsUnplugged) {
  const auto device = opened();
  device->claim(0);
  std::thread reader([&] {
    std::array<std::uint8_t, 8> data{};
    EXPECT_EQ(device->read(endpoint(*device, 0x82), data, 60000ms).outcome, Outcome::gone);
  });
  wire->unplug(1);
  reader.join();
}

TEST(UsbListing, FitsByWhatTheAddressNames) {
  const Listing one{0x04d8, 0x00dd, "0001AB", "1-1.4", true};
  EXPECT_TRUE(fits(UsbAddress::parse("usb:04d8:00dd"), one));
  EXPECT_TRUE(fits(UsbAddress::parse("usb:*:*:0001AB"), one));
  EXPECT_TRUE(fits(UsbAddress::parse("usb:04d8:00dd:0001AB@1-1.4"), one));
  EXPECT_FALSE(fits(UsbAddress::parse("usb:04d8:00dd:0001AC"), one));
  EXPECT_FALSE(fits(UsbAddress::parse("usb:04d8:00dd@1-1"), one));
  EXPECT_FALSE(fits(UsbAddress::parse("usb:04d8:00de"), one));
}

}  // namespace bus_test
}  // namespace kphi::usb
