// An operator whose answers come from a file: for a campaign without a terminal.
#pragma once

#include <cstddef>
#include <string>

#include "daq/campaign/operator.hpp"
#include "profiles/answers.hpp"

namespace kphi::daq {

/// Strict: each question takes the next answer of its kind. A missing, wrong or left-over answer throws
/// ConfigurationError with its line in the file. Agreeing to another run of an occlusion that is mounted again for each
/// run also confirms that mounting.
class AnsweringOperator final : public Operator {
 public:
  explicit AnsweringOperator(profiles::Answers answers) : answers_(std::move(answers)) {}
  [[nodiscard]] bool run_again(const AnotherRun& question) override;
  void clear_safety_stop(const std::string& reason) override;
  void finish() override;
  [[nodiscard]] std::string name() const override { return answers_.path; }

 protected:
  void mount(const profiles::Propeller& propeller, double occlusion_deg, const std::string& condition) override;

 private:
  profiles::Answers answers_;
  std::size_t mountings_ = 0;  ///< taken
  std::size_t decisions_ = 0;  ///< taken
  bool remounting_ = false;    ///< the next mounting belongs to another run that was agreed to
};

}  // namespace kphi::daq
