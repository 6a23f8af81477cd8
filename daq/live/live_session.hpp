// The live view that `--live` and `--udp-json` ask for.
#pragma once

#include <exception>
#include <memory>
#include <optional>
#include <string>

#include "daq/live/feed.hpp"
#include "daq/live/server.hpp"
#include "daq/live/subject.hpp"
#include "daq/live/udp_json.hpp"
#include "daq/run/progress.hpp"

namespace kphi::daq::live {

struct LiveOptions {
  std::optional<std::uint16_t> port;  ///< of the page; 0: any that is free
  std::string udp_json;               ///< HOST:PORT; empty: no plotter
  [[nodiscard]] bool any() const { return port || !udp_json.empty(); }
};

class LiveSession {
 public:
  /// The page can be opened as soon as this returns. Throws ConfigurationError.
  LiveSession(const LiveOptions& options, Subject subject);

  /// Address of the page, with the token; empty without a page.
  [[nodiscard]] std::string url() const { return server_ ? server_->url() : std::string(); }
  /// Somebody pressed STOP. Any thread.
  [[nodiscard]] bool stop_asked() const noexcept { return feed_.stop_asked(); }
  /// A page is open. Any thread.
  [[nodiscard]] bool is_watched() const noexcept { return server_ && server_->counts().clients > 0; }
  /// A progress for `behind` and the live view; `behind`, `clock` and this must outlive it.
  [[nodiscard]] std::unique_ptr<Progress> beside(Progress& behind, const Clock& clock);

  /// Does the work and shows on the pages how it ended.
  template <class Work>
  auto tell_the_end(Work&& work) {
    try {
      auto result = work();
      end(true, "finished");
      return result;
    } catch (const std::exception& e) {
      end(false, e.what());
      throw;
    }
  }

 private:
  void end(bool well, const std::string& words);

  Subject subject_;
  Feed feed_;
  const Clock* clock_ = nullptr;  ///< of the run; nullptr before it
  std::unique_ptr<UdpJson> plotter_;
  std::unique_ptr<Server> server_;  ///< last member: it reads the others
};

}  // namespace kphi::daq::live
