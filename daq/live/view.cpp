#include "daq/live/view.hpp"

#include "daq/live/gate.hpp"
#include "daq/live/live_progress.hpp"
#include "daq/live/messages.hpp"
#include "daq/live/page.hpp"

namespace kphi::daq::live {

View::View(const Wishes& wishes, Subject subject) : subject_(std::move(subject)) {
  if (!wishes.udp_json.empty()) plotter_ = std::make_unique<UdpJson>(wishes.udp_json, subject_.limits);
  if (!wishes.port) return;
  Server::Settings settings;
  settings.port = *wishes.port;
  settings.token = new_token();
  settings.page = page_text();
  settings.hello = hello_message(subject_);
  settings.can_stop = !subject_.replay;
  server_ = std::make_unique<Server>(std::move(settings), feed_);
}

std::unique_ptr<Progress> View::beside(Progress& behind, const Clock& clock) {
  clock_ = &clock;
  return std::make_unique<LiveProgress>(behind, feed_, plotter_.get(), subject_, clock);
}

void View::end(bool well, const std::string& words) {
  feed_.tell(end_message(clock_ != nullptr ? to_seconds(clock_->now()) : 0, well, words));
}

}  // namespace kphi::daq::live
