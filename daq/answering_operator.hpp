// An operator whose answers were written down before: a campaign without a terminal.
#pragma once

#include <cstddef>
#include <string>

#include "daq/operator.hpp"
#include "profiles/answers.hpp"

namespace kphi::daq {

/// Strict: each question takes the next answer of its kind. A missing or wrong one, and one that is left over at the
/// end, throws ConfigurationError with its place in the file. What is answered with another run of an occlusion that is
/// mounted anew each time also confirms that mounting.
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
