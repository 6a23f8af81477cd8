// The person who mounts occlusions, and decides what a program cannot.
#pragma once

#include <cstdio>
#include <functional>
#include <optional>
#include <string>

#include "daq/interrupt.hpp"
#include "daq/mounted.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq {

/// The person said no, or there was nobody to ask. Nothing was recorded for this mounting.
class NotMounted : public Interrupted {
 public:
  using Interrupted::Interrupted;
};

/// The repetitions of an occlusion disagree.
struct AnotherRun {
  double occlusion_deg = 0;
  std::string reason;         ///< one line
  int extra = 1;              ///< it would be the first, the second … beyond those planned
  int extra_max = 1;          ///< that the campaign allows
  bool mounted_anew = false;  ///< before it the occlusion is asked for
};

/// Whoever stands at the bench. All members are called from the runner's thread, while the motor coasts.
class Operator {
 public:
  /// Writes down each question and each answer, right or wrong, as it comes.
  using Scribe = std::function<void(const char* event, const std::string& words)>;

  virtual ~Operator() = default;
  /// Asks for one mounting and returns once it is confirmed: the only way to what unlocks the motor. Throws NotMounted.
  /// `condition`: one sentence on what motor and supply do, "The supply's output is off."
  [[nodiscard]] Mounted confirm_mounting(const profiles::Propeller& propeller, double occlusion_deg,
                                         const std::string& condition = {}) {
    mount(propeller, occlusion_deg, condition);
    return Mounted(occlusion_deg);
  }
  /// Shows what stopped the campaign and asks whether somebody has looked at the stand since. Returns when it may
  /// continue; throws NotMounted when the person says no, and ConfigurationError when there is nobody to ask.
  virtual void clear_safety_stop(const std::string& reason);
  /// Asks whether to run it again; no, when nobody is there. Throws Interrupted when the person wants to stop.
  [[nodiscard]] virtual bool run_again(const AnotherRun&) { return false; }
  /// Nothing more will be asked. Throws ConfigurationError when more was answered than asked.
  virtual void finish() {}
  /// How it answers, for the record: "terminal", "--yes", "answers.yaml".
  [[nodiscard]] virtual std::string name() const { return "program"; }
  void dictate_to(Scribe scribe) { scribe_ = std::move(scribe); }
  /// Called again and again while a person is waited for; what it throws ends the question.
  void let_watch(std::function<void()> watch) { watch_ = std::move(watch); }

 protected:
  virtual void mount(const profiles::Propeller& propeller, double occlusion_deg, const std::string& condition) = 0;
  void watch() const {
    if (watch_) watch_();
  }
  void asked(const std::string& words) { write_down("operator_asked", words); }
  void answered(const std::string& words) { write_down("operator_answered", words); }

 private:
  void write_down(const char* event, const std::string& words) {
    if (scribe_) scribe_(event, words);
  }
  Scribe scribe_;
  std::function<void()> watch_;
};

/// Takes every mounting as done (`--yes`): a simulated bench, or a robot's. Runs an occlusion again once at most: what
/// still disagrees then is for a person to look at.
class AgreeingOperator final : public Operator {
 public:
  /// `clears_safety_stops`: of a simulated bench, at which nobody can be hurt.
  explicit AgreeingOperator(bool clears_safety_stops = false) : clears_safety_stops_(clears_safety_stops) {}
  void clear_safety_stop(const std::string& reason) override;
  [[nodiscard]] bool run_again(const AnotherRun& question) override { return question.extra == 1; }
  [[nodiscard]] std::string name() const override { return "--yes"; }

 protected:
  void mount(const profiles::Propeller&, double, const std::string&) override {}

 private:
  const bool clears_safety_stops_;
};

/// Asks on a terminal; the person types the angle that was mounted. Waits without limit; a wrong angle is asked again,
/// "q" or end of file means no.
class TerminalOperator final : public Operator {
 public:
  /// `stop_asked`: true when a signal came while waiting.
  TerminalOperator(int input_descriptor, std::FILE* words, std::function<bool()> stop_asked)
      : input_(input_descriptor), words_(words), stop_asked_(std::move(stop_asked)) {}
  [[nodiscard]] bool run_again(const AnotherRun& question) override;
  void clear_safety_stop(const std::string& reason) override;
  [[nodiscard]] std::string name() const override { return "terminal"; }

 protected:
  void mount(const profiles::Propeller& propeller, double occlusion_deg, const std::string& condition) override;

 private:
  /// `about` is what the question is about, printed before; a question that is asked again has none.
  std::string answer_to(const std::string& about, const std::string& question);
  /// Nothing: there is no more input.
  std::optional<std::string> read_line();
  int input_;
  std::FILE* words_;
  std::function<bool()> stop_asked_;
};

}  // namespace kphi::daq
