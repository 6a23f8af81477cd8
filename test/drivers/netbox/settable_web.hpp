// A box whose settings can be written, with the bad manners of true ones.
#pragma once

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "drivers/netbox/configuration/configuration.hpp"
#include "test/drivers/netbox/fake_box.hpp"

namespace kphi::netbox::test {

class SettableWeb {
 public:
  struct Manner {
    int writes_ignored = 0;                ///< answered, and nothing done
    std::map<std::string, int> at_most{};  ///< clamps in silence
    std::string write_status = "302 Found";
    std::string serial = "LOT0001";
  };

  SettableWeb() : web_({{}, {}, false, [this](const std::string& request) { return answer(request); }}) {}

  std::uint16_t port() const { return web_.port(); }
  Address address() const { return {"127.0.0.1", 1, port()}; }
  std::string value(const std::string& key) const {
    const std::lock_guard lock(mutex_);
    return values_.at(key);
  }
  void set(const std::string& key, const std::string& value) {
    const std::lock_guard lock(mutex_);
    values_[key] = value;
  }
  void behave(Manner manner) {
    const std::lock_guard lock(mutex_);
    manner_ = std::move(manner);
  }
  /// Of any kind.
  int requests() const {
    const std::lock_guard lock(mutex_);
    return requests_;
  }
  /// Targets of the CGI requests, in their order.
  std::vector<std::string> writes() const {
    const std::lock_guard lock(mutex_);
    return writes_;
  }

 private:
  static std::string respond(const std::string& status, const std::string& body) {
    return "HTTP/1.0 " + status + "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
  }
  std::string answer(const std::string& request) {
    const std::lock_guard lock(mutex_);
    ++requests_;
    const std::string target = request.substr(4, request.find(' ', 4) - 4);
    const std::size_t question = target.find('?');
    const std::string query = question == std::string::npos ? "" : target.substr(question + 1);
    if (target.find(".cgi") != std::string::npos) return write(target, query);
    std::string xml = with(captured_xml(), "mfgdigsn", manner_.serial.c_str());
    for (const auto& [key, value] : values_) xml = with(xml, key, value.c_str());
    if (query.rfind("index=", 0) == 0 && query != "index=0" && query != "index=3")
      xml = with(with(xml, "cfgcalsn", "FT0000"), "cfgmr", "0;0;0;0;0;0");
    return respond("200 OK", xml);
  }
  std::string write(const std::string& target, std::string query) {
    writes_.push_back(target);
    if (manner_.writes_ignored-- > 0) return respond("302 Found", "");
    while (!query.empty()) {
      const std::string pair = query.substr(0, query.find('&'));
      query.erase(0, pair.size() + 1);
      const std::size_t equals = pair.find('=');
      if (equals == std::string::npos) continue;
      const std::string key = pair.substr(0, equals);
      int value = std::stoi(pair.substr(equals + 1));
      if (manner_.at_most.contains(key)) value = std::min(value, manner_.at_most[key]);
      if (key == "comrdtrate") value = 7000 / (7000 / value);
      values_[key] = std::to_string(value);
    }
    return respond(manner_.write_status, "");
  }

  mutable std::mutex mutex_;
  Manner manner_;
  std::map<std::string, std::string> values_{
      {"comrdtrate", "7000"}, {"comrdtbsiz", "40"}, {"setuserfilter", "0"}, {"setcfgsel", "0"}};
  std::vector<std::string> writes_;
  int requests_ = 0;
  FakeWeb web_;
};

}  // namespace kphi::netbox::test
