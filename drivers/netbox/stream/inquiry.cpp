#include "drivers/netbox/stream/inquiry.hpp"

#include <signal.h>

#include <exception>
#include <utility>

#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/configuration/http.hpp"

namespace kphi::netbox {
namespace {

constexpr std::chrono::seconds kTimeout{2};

}  // namespace

Inquiry::Inquiry(Address address, const Clock& clock, Configuration known, Wakeup& bell)
    : address_(std::move(address)), clock_(clock), bell_(bell), known_(std::move(known)), thread_([this] { run(); }) {}

Inquiry::~Inquiry() {
  order_ = kEnd;
  order_.notify_one();
  thread_.join();
}

void Inquiry::ask() noexcept {
  int rest = kRest;
  if (order_.compare_exchange_strong(rest, kAsk)) order_.notify_one();
}

void Inquiry::run() noexcept {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
  for (;;) {
    order_.wait(kRest);
    int ask = kAsk;
    if (!order_.compare_exchange_strong(ask, kRest)) return;
    Answer answer = find_out();
    answer.at = clock_.now();
    answers_.push(answer);
    bell_.raise();
  }
}

Inquiry::Answer Inquiry::find_out() noexcept {
  Answer answer;
  try {
    const std::string xml = http_get(address_.host, address_.http_port, "/netftapi2.xml", kTimeout);
    answer.box = BoxAnswer::unusable;
    Configuration fresh = parse_configuration(xml);
    const std::lock_guard lock(mutex_);
    answer.changes = compare(known_, fresh);
    answer.booted = forgot_peaks(known_, fresh);
    answer.box = fresh.rdt_enabled ? BoxAnswer::ready : BoxAnswer::rdt_disabled;
    known_ = std::move(fresh);
  } catch (const std::exception&) {
    // `answer` says how far it came.
  }
  return answer;
}

Configuration Inquiry::latest() const {
  const std::lock_guard lock(mutex_);
  return known_;
}

}  // namespace kphi::netbox
