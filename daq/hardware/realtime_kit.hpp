// RealtimeKit, the service of desktops that gives threads of ordinary users real-time priority.
#pragma once

#include <sys/types.h>

#include <string>

namespace kphi::daq {

/// Asks it for a thread of this process. Empty: given; else why not. Takes at most 1 s. It demands that this process
/// lets the kernel end it when such a thread computes for 200 ms without a pause (RLIMIT_RTTIME). A real_time::Grantor.
[[nodiscard]] std::string ask_realtime_kit(pid_t thread, int priority);

inline constexpr const char* kGrantPriority =
    "write `@dialout - rtprio 20` into /etc/security/limits.d/kphi.conf and log in again, or keep this computer idle";

/// For the operator, of real_time::refusal(): consequence, cause, next move; empty if nothing was refused.
[[nodiscard]] std::string priority_words(const std::string& refusal);

}  // namespace kphi::daq
