// Calls of services on the system bus, each with its time limit: a bus or a service that does not answer holds nobody
// up.
#pragma once

#include <systemd/sd-bus.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

namespace kphi::daq {

class SystemBus {
 public:
  using SteadyTime = std::chrono::steady_clock::time_point;
  /// For one answer, and to connect.
  static constexpr std::chrono::milliseconds kOneAnswer{500};

  struct Release {
    /// Does not flush: that would wait for a peer that does not read.
    void operator()(sd_bus* bus) const noexcept { sd_bus_close_unref(bus); }
    void operator()(sd_bus_message* message) const noexcept { sd_bus_message_unref(message); }
  };
  using Message = std::unique_ptr<sd_bus_message, Release>;
  struct Service {
    const char* name;
    const char* path;
    const char* interface;
  };
  struct Answer {
    int error = 0;  ///< negative errno
    std::string cause;
    Message message;
  };

  /// Returns when the bus has greeted back, or failed to.
  SystemBus() noexcept;
  /// 0, or an errno.
  [[nodiscard]] int error() const noexcept { return error_; }
  /// Waits at most until `end`, and at most kOneAnswer. `types` and the arguments as sd_bus_call_method(3) has them.
  template <class... Arguments>
  [[nodiscard]] Answer call(const Service& service, const char* method, SteadyTime end, const char* types,
                            Arguments... arguments) {
    limit_until(end);
    sd_bus_error why = SD_BUS_ERROR_NULL;
    sd_bus_message* message = nullptr;
    const int error = sd_bus_call_method(bus_.get(), service.name, service.path, service.interface, method, &why,
                                         &message, types, arguments...);
    return answer(error, why, message);
  }

 private:
  void limit_until(SteadyTime end) noexcept;
  [[nodiscard]] static Answer answer(int error, sd_bus_error& why, sd_bus_message* message);

  std::unique_ptr<sd_bus, Release> bus_;
  int error_ = 0;
};

}  // namespace kphi::daq
