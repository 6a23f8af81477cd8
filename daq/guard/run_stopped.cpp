#include "daq/guard/run_stopped.hpp"

#include <fmt/format.h>
#include <signal.h>

#include <array>
#include <atomic>

namespace kphi::daq {
namespace {

std::atomic<int> g_count{0};
std::atomic<bool> g_suspension{false};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP};
std::array<struct sigaction, kSignals.size()> g_previous{};

void note(int signal) {
  if (signal == SIGTSTP)
    g_suspension = true;
  else
    g_count.fetch_add(1);
}

void append(std::string& words, const std::string& text) {
  if (!text.empty()) words += (words.empty() ? "" : "; ") + text;
}

}  // namespace

void StopWords::also(const std::string& text) { append(consequences, text); }

void StopWords::leaves(const std::string& text) { append(state, text); }

std::string StopWords::line() const {
  std::string line = cause;
  append(line, consequences);
  append(line, state);
  return line;
}

std::string StopWords::text(const std::string& headline) const {
  std::string text = fmt::format("{}: {}\n", headline, cause);
  const auto add = [&](const char* what, const std::string& words) {
    if (!words.empty()) text += fmt::format("  {:<6} {}\n", what, words);
  };
  add("also:", consequences);
  add("next:", next_move);
  add("data:", data);
  if (!state.empty()) text += "  " + state + "\n";
  return text;
}

void require_no_stop(const StopAsked& stop_asked, const char* when) {
  if (stop_asked()) throw Interrupted(std::string("stopped by request ") + when);
}

StopWords words_of(const std::exception_ptr& cause) {
  try {
    std::rethrow_exception(cause);
  } catch (const RunStopped& e) {
    return e.words();
  } catch (const std::exception& e) {
    return {.cause = e.what()};
  } catch (...) {
    return {.cause = "unknown"};
  }
}

SignalWatch::SignalWatch() {
  g_count = 0;
  g_suspension = false;
  struct sigaction action {};
  action.sa_handler = note;
  sigemptyset(&action.sa_mask);
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &action, &g_previous[i]);
}

SignalWatch::~SignalWatch() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &g_previous[i], nullptr);
}

int SignalWatch::count() noexcept { return g_count.load(); }

bool SignalWatch::is_suspension_asked() noexcept { return g_suspension.load(); }

bool SignalWatch::take_suspension() noexcept { return g_suspension.exchange(false); }

void SignalWatch::suspend() noexcept {
  struct sigaction by_default {
  }, before{};
  by_default.sa_handler = SIG_DFL;
  sigemptyset(&by_default.sa_mask);
  sigaction(SIGTSTP, &by_default, &before);
  ::raise(SIGTSTP);
  sigaction(SIGTSTP, &before, nullptr);
  g_suspension = false;
}

}  // namespace kphi::daq
