#include "commands/so_far.hpp"

#include <exception>

#include "fit/plan/outlook.hpp"

namespace kphi::commands {

daq::SoFar so_far(const profiles::Campaign& campaign, const std::vector<std::string>& wishes) {
  std::vector<fit::Wish> wanted;
  for (const std::string& text : wishes) wanted.push_back(fit::parse_wish(text));
  return [&campaign, wanted](std::span<const results::StepMean> steps) -> std::string {
    try {
      return fit::to_words(fit::reached_so_far(steps, campaign, {}, wanted));
    } catch (const std::exception&) {
      return {};  // a line of news is not worth a campaign
    }
  };
}

}  // namespace kphi::commands
