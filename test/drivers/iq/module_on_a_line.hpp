// A fake module at the far end of a pseudo-terminal, in a thread of its own.
#pragma once

#include <poll.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "test/drivers/iq/fake_module.hpp"
#include "test/drivers/serial/pseudo_terminal.hpp"

namespace kphi::iq::fake {

class ModuleOnALine {
 public:
  /// `prepare`: what is different about this module.
  explicit ModuleOnALine(const std::function<void(Module&)>& prepare = [](Module&) {}) {
    prepare(module_);
    thread_ = std::thread([this] { run(); });
  }
  ~ModuleOnALine() { unplug(); }
  ModuleOnALine(const ModuleOnALine&) = delete;
  ModuleOnALine& operator=(const ModuleOnALine&) = delete;

  [[nodiscard]] const std::string& device() const { return terminal_.name(); }
  /// The module's end of the line.
  [[nodiscard]] int master() const { return terminal_.master(); }
  /// Look at the module, or change it.
  template <class Work>
  auto with(Work&& work) {
    const std::lock_guard lock(mutex_);
    return work(module_);
  }
  /// Further modules that hear the same line.
  template <class Work>
  void with_others(Work&& work) {
    const std::lock_guard lock(mutex_);
    work(others_);
  }
  /// Waits until `what(module)` holds after something was heard.
  template <class What>
  bool wait_for(What&& what, std::chrono::milliseconds limit = std::chrono::milliseconds(3000)) {
    std::unique_lock lock(mutex_);
    return heard_.wait_for(lock, limit, [&] { return what(module_); });
  }
  void unplug() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    terminal_.unplug();
  }
  /// Hears what is still in the line, and tells whether the last motion command was a coast.
  bool left_coasting() {
    for (pollfd line{terminal_.master(), POLLIN, 0}; ::poll(&line, 1, 0) > 0 && (line.revents & POLLIN) != 0;) {
      std::this_thread::yield();
    }
    const std::lock_guard lock(mutex_);
    return module_.last_motion() != nullptr && module_.last_motion()->is_coast();
  }
  /// Motion commands but for coasts.
  [[nodiscard]] std::size_t motions() {
    return with([](Module& m) { return m.count([](const auto& h) { return h.is_motion() && !h.is_coast(); }); });
  }
  [[nodiscard]] bool heard_a_speed(double speed) {
    return wait_for([&](const Module& m) {
      return m.last_motion() != nullptr && m.last_motion()->is_speed() &&
             to_f32(m.last_motion()->data) == static_cast<float>(speed);
    });
  }

 private:
  void run() {
    while (!stop_) {
      pollfd line{terminal_.master(), POLLIN, 0};
      if (::poll(&line, 1, 5) <= 0) continue;
      std::uint8_t buffer[512];
      const std::lock_guard lock(mutex_);  // held from the read on: left_coasting must not look in between
      const auto n = ::read(terminal_.master(), buffer, sizeof buffer);
      if (n <= 0) continue;
      answer(std::span(buffer, static_cast<std::size_t>(n)));
      heard_.notify_all();
    }
  }

  /// At the wrong rate both sides hear garbage.
  void answer(std::span<std::uint8_t> bytes) {
    const bool understood = module_.baud == 0 || module_.baud == terminal_.baud();
    if (!understood) {
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(byte * 37 + 0x55);
    }
    for (Module& other : others_) {
      for (const Bytes& reply : other.receive(bytes)) send(reply);
    }
    for (const Bytes& reply : module_.receive(bytes)) send(reply);
    if (!understood) send({0x55, 0x3B, 0x80, 0x00});
  }
  void send(const Bytes& bytes) {
    [[maybe_unused]] const auto written = ::write(terminal_.master(), bytes.data(), bytes.size());
  }

  serial::fake::PseudoTerminal terminal_;
  std::mutex mutex_;
  std::condition_variable heard_;
  Module module_;
  std::vector<Module> others_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace kphi::iq::fake
