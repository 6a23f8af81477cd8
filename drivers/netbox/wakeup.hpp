// A bell between threads that poll() can wait for.
#pragma once

namespace kphi::netbox {

/// raise: any thread.
class Wakeup {
 public:
  Wakeup();
  ~Wakeup();
  Wakeup(const Wakeup&) = delete;
  Wakeup& operator=(const Wakeup&) = delete;
  void raise() noexcept;
  void clear() noexcept;
  /// Readable while raised.
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }

 private:
  int descriptor_;
};

}  // namespace kphi::netbox
