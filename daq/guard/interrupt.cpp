#include "daq/guard/interrupt.hpp"

#include <signal.h>

#include <array>
#include <atomic>

namespace kphi::daq {
namespace {

std::atomic<int> g_count{0};
static_assert(std::atomic<int>::is_always_lock_free);

constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP, SIGQUIT};
std::array<struct sigaction, kSignals.size()> g_previous{};

void count_signal(int) { g_count.fetch_add(1); }

}  // namespace

SignalWatch::SignalWatch() {
  g_count = 0;
  struct sigaction action {};
  action.sa_handler = count_signal;
  sigemptyset(&action.sa_mask);
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &action, &g_previous[i]);
}

SignalWatch::~SignalWatch() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &g_previous[i], nullptr);
}

int SignalWatch::count() noexcept { return g_count.load(); }

}  // namespace kphi::daq
