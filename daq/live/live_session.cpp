#include "daq/live/live_session.hpp"

#include "daq/live/access_control.hpp"
#include "daq/live/live_progress.hpp"
#include "daq/live/messages.hpp"
#include "daq/live/page.hpp"

namespace kphi::daq::live {

LiveSession::LiveSession(const LiveOptions& options, Subject subject) : subject_(std::move(subject)) {
  if (!options.udp_json.empty()) plotter_ = std::make_unique<UdpJson>(options.udp_json, subject_.limits);
  if (!options.port) return;
  Server::Settings settings;
  settings.port = *options.port;
  settings.token = new_token();
  settings.page = page_text();
  settings.hello = hello_message(subject_);
  settings.can_stop = !subject_.replay;
  server_ = std::make_unique<Server>(std::move(settings), feed_);
}

std::unique_ptr<Progress> LiveSession::beside(Progress& behind, const Clock& clock) {
  clock_ = &clock;
  return std::make_unique<LiveProgress>(behind, feed_, plotter_.get(), subject_, clock);
}

void LiveSession::end(bool well, const std::string& words) {
  feed_.tell(end_message(clock_ != nullptr ? to_seconds(clock_->now()) : 0, well, words));
}

}  // namespace kphi::daq::live
