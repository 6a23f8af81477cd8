#include "drivers/netbox/inquiry.hpp"

#include <signal.h>

#include <exception>
#include <utility>

#include "drivers/netbox/configuration.hpp"
#include "drivers/netbox/http.hpp"

namespace kphi::netbox {
namespace {

constexpr std::chrono::seconds kTimeout{2};

}  // namespace

Inquiry::Inquiry(std::string host, std::uint16_t http_port, const Clock& clock, EventQueue& answers)
    : host_(std::move(host)), http_port_(http_port), clock_(clock), answers_(answers), thread_([this] { run(); }) {}

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
    Event answer;
    answer.kind = find_out();
    answer.at = clock_.now();
    answers_.push(answer);
  }
}

EventKind Inquiry::find_out() const noexcept {
  try {
    const std::string xml = http_get(host_, http_port_, "/netftapi2.xml", kTimeout);
    return parse_configuration(xml).rdt_enabled ? EventKind::stolen : EventKind::rdt_disabled;
  } catch (const std::exception&) {
    return EventKind::unreachable;
  }
}

}  // namespace kphi::netbox
