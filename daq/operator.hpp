// The person who mounts occlusions.
#pragma once

#include <cstdio>
#include <functional>
#include <string>

#include "daq/interrupt.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq {

/// The person said no, or there was nobody to ask. Nothing was recorded for this mounting.
class NotMounted : public Interrupted {
 public:
  using Interrupted::Interrupted;
};

/// Asks for one mounting and returns once it is confirmed. Throws NotMounted.
class Operator {
 public:
  virtual ~Operator() = default;
  virtual void mount(const profiles::Propeller& propeller, double occlusion_deg) = 0;
};

/// Takes every mounting as done (`--yes`): a simulated bench, or a robot's.
class AgreeingOperator final : public Operator {
 public:
  void mount(const profiles::Propeller&, double) override {}
};

/// Asks on a terminal; the person types the angle that was mounted. Waits without limit; a wrong angle is asked again,
/// "q" or end of file means no.
class TerminalOperator final : public Operator {
 public:
  /// `stop_asked`: true when a signal came while waiting.
  TerminalOperator(int input_descriptor, std::FILE* words, std::function<bool()> stop_asked)
      : input_(input_descriptor), words_(words), stop_asked_(std::move(stop_asked)) {}
  void mount(const profiles::Propeller& propeller, double occlusion_deg) override;

 private:
  std::string read_line();
  int input_;
  std::FILE* words_;
  std::function<bool()> stop_asked_;
};

}  // namespace kphi::daq
