// A USBTMC instrument as a transport, written from the standard's tables, with ways to misbehave.
#pragma once

#include <deque>
#include <functional>
#include <string>

#include "drivers/usb/bus.hpp"

namespace kphi::scpi {

class FakeInstrument final : public usb::Transport {
 public:
  using Bytes = std::vector<std::uint8_t>;

  std::function<std::string(const std::string&)> apply = [](const std::string& command) {
    return command == "*IDN?" ? "KPHI,FAKE,1,0" : "";
  };
  std::vector<std::string> commands;
  std::vector<int> class_requests;  ///< bRequest of each, in order
  std::uint8_t interface_caps = 0x04, usb488_caps = 0x02 | 0x08;
  std::size_t part = 4096;    ///< largest part of an answer
  std::size_t packet = 4096;  ///< bytes of one bulk-IN
  int empty_first = 0;        ///< so many empty packets before answers
  int wrong_tags = 0;         ///< so many answers with the tag of another request
  int mute = 0;               ///< so many requests for answers time out; the answer comes later
  int stalls = 0;
  int pending = 0;  ///< so many checks of a clear or abort are pending
  bool unplugged = false;
  bool clear_fails = false;
  std::uint16_t vendor_id = 0x1234, product_id = 0x5678;

  const std::string& name() const noexcept override { return name_; }
  std::uint16_t vendor() const noexcept override { return vendor_id; }
  std::uint16_t product() const noexcept override { return product_id; }
  const std::vector<usb::Interface>& interfaces() const noexcept override { return interfaces_; }
  void claim(std::uint8_t) override {}
  usb::Outcome clear_halt(const usb::Endpoint&) noexcept override { return usb::Outcome::done; }

  usb::Transfer control_in(const usb::Setup& setup, std::span<std::uint8_t> data, Timeout) noexcept override {
    if (unplugged) return {usb::Outcome::gone};
    class_requests.push_back(setup.request);
    std::fill(data.begin(), data.end(), std::uint8_t{0});
    data[0] = 1;
    const int request = setup.request;
    if (request == 1 || request == 3 || request == 5) queue_.clear();
    if ((request == 2 || request == 4 || request == 6) && pending > 0) --pending, data[0] = 2;
    if (request == 5) answer_.clear();
    if (request == 5 && clear_fails) data[0] = 0x80;
    if (request == 7 && data.size() == 24) data[4] = interface_caps, data[15] = usb488_caps;
    return {usb::Outcome::done, data.size()};
  }

  usb::Transfer write(const usb::Endpoint&, std::span<const std::uint8_t> b, Timeout) noexcept override {
    if (unplugged) return {usb::Outcome::gone};
    const std::uint32_t size = b[4] | b[5] << 8;
    if (b[0] == 1) {
      std::string text(b.begin() + 12, b.begin() + 12 + size);
      while (!text.empty() && text.back() == '\n') text.pop_back();
      commands.push_back(text);
      answer_ = apply(text);
      if (!answer_.empty()) answer_ += '\n';
    } else if (b[0] == 2) {
      request(b[1]);
    }
    return {usb::Outcome::done, b.size()};
  }

  usb::Transfer read(const usb::Endpoint&, std::span<std::uint8_t> into, Timeout) noexcept override {
    if (unplugged) return {usb::Outcome::gone};
    if (stalls > 0) return --stalls, usb::Transfer{usb::Outcome::stalled};
    if (queue_.empty()) return {usb::Outcome::timed_out};
    const Bytes bytes = queue_.front();
    queue_.pop_front();
    std::copy(bytes.begin(), bytes.end(), into.begin());
    return {usb::Outcome::done, bytes.size()};
  }

 private:
  void request(std::uint8_t tag) {
    if (answer_.empty()) return;
    if (mute > 0) {
      --mute;
      return;
    }
    if (wrong_tags > 0) --wrong_tags, tag = static_cast<std::uint8_t>(tag - 1);
    const std::size_t n = std::min(part, answer_.size());
    const bool end = n == answer_.size();
    Bytes bytes(12);
    bytes[0] = 2, bytes[1] = tag, bytes[2] = static_cast<std::uint8_t>(~tag);
    bytes[4] = static_cast<std::uint8_t>(n), bytes[5] = static_cast<std::uint8_t>(n >> 8);
    bytes[8] = static_cast<std::uint8_t>(end);
    bytes.insert(bytes.end(), answer_.begin(), answer_.begin() + static_cast<std::ptrdiff_t>(n));
    answer_.erase(0, n);
    while (bytes.size() % 4 != 0) bytes.push_back(0);
    if (empty_first > 0) --empty_first, queue_.push_back({});
    for (std::size_t at = 0; at < bytes.size(); at += packet) {
      const std::size_t more = std::min(packet, bytes.size() - at);
      queue_.emplace_back(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                          bytes.begin() + static_cast<std::ptrdiff_t>(at + more));
    }
  }

  std::string name_ = "USB device 1234:5678, serial A1";
  std::vector<usb::Interface> interfaces_{
      {0, 0xFE, 0x03, 0x01, {{0x82, usb::EndpointKind::bulk, 512}, {0x01, usb::EndpointKind::bulk, 512}}}};
  std::string answer_;
  std::deque<Bytes> queue_;
};

}  // namespace kphi::scpi
