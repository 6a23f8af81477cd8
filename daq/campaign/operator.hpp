// The person who mounts occlusions and takes the decisions that a program cannot; or a file with their answers.
#pragma once

#include <cstdio>
#include <functional>
#include <optional>
#include <string>

#include "daq/guard/run_stopped.hpp"
#include "daq/run/run_order.hpp"
#include "daq/run/terminal.hpp"
#include "profiles/answers.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq {

/// What a typed answer means: "Go " is "go".
[[nodiscard]] std::string understood(const std::string& typed);

/// The person said no, or there was nobody to ask. This mounting is not recorded.
class NotMounted : public Interrupted {
 public:
  using Interrupted::Interrupted;
};

/// An occlusion needs another run: its repetitions disagree, or its k is not certain enough.
struct AnotherRun {
  double occlusion_deg = 0;
  std::string reason;         ///< one line
  int extra = 1;              ///< number of this run among those beyond the plan, from 1
  int extra_max = 1;          ///< the campaign allows this many
  bool mounted_anew = false;  ///< the occlusion must be mounted again before it
  bool decided = false;       ///< by the campaign file: nobody is asked
};

/// The person at the bench. All members are called from the runner's thread, while the motor coasts.
class Operator {
 public:
  /// Records each question and each answer, right or wrong, as it comes; `took`: wall time of a person for an answer.
  using AuditLog =
      std::function<void(const char* event, const std::string& words, const std::optional<Duration>& took)>;

  virtual ~Operator() = default;
  /// Asks for one mounting and returns once it is confirmed: the only way to unlock the motor. Throws NotMounted.
  /// `condition`: one sentence on the state of motor and supply, "The supply's output is off."
  [[nodiscard]] MountConfirmation confirm_mounting(const profiles::Propeller& propeller, double occlusion_deg,
                                                   const std::string& condition = {}) {
    mount(propeller, occlusion_deg, condition);
    return MountConfirmation(occlusion_deg);
  }
  /// Asks whether nobody and nothing is near the propeller, whatever is mounted, and returns once it is confirmed: the
  /// other way to unlock the motor. Throws NotMounted. `speed_rpm` that it will turn at.
  [[nodiscard]] MountConfirmation confirm_clear(double speed_rpm, const std::string& condition = {}) {
    clear_stand(speed_rpm, condition);
    return MountConfirmation(0);
  }
  /// Shows what stopped the campaign and asks whether a person has looked at the stand since. Returns if it may
  /// continue; throws NotMounted if the person says no, ConfigurationError if there is nobody to ask.
  virtual void clear_safety_stop(const std::string& reason);
  /// Shows what is allowed in the campaign and rarely meant, and asks a person whether it is. Returns if it may begin;
  /// throws NotMounted if not.
  virtual void accept_doubts(const std::string&) {}
  /// Asks whether to run the occlusion again; false without a person. Throws Interrupted if the person wants to stop.
  [[nodiscard]] virtual bool run_again(const AnotherRun&) { return false; }
  /// No more questions follow. Throws ConfigurationError if answers are left over.
  virtual void finish() {}
  /// How it answers, for the record: "terminal", "--yes", "answers.yaml".
  [[nodiscard]] virtual std::string name() const { return "program"; }
  void log_to(AuditLog log) { log_ = std::move(log); }
  /// `poll` is called periodically while kphi waits for a person; an exception from it ends the question.
  void while_waiting(std::function<void()> poll) { poll_ = std::move(poll); }

 protected:
  virtual void mount(const profiles::Propeller& propeller, double occlusion_deg, const std::string& condition) = 0;
  virtual void clear_stand(double speed_rpm, const std::string& condition);
  void poll() const {
    if (poll_) poll_();
  }
  void asked(const std::string& words) { record("operator_asked", words); }
  void answered(const std::string& words, const std::optional<Duration>& took = std::nullopt) {
    record("operator_answered", words, took);
  }

 private:
  void record(const char* event, const std::string& words, const std::optional<Duration>& took = std::nullopt) {
    if (log_) log_(event, words, took);
  }
  AuditLog log_;
  std::function<void()> poll_;
};

/// Takes every mounting as done (`--yes`): for a simulated bench, or a robot. Runs an occlusion again at most once; if
/// the repetitions still disagree, a person should look at the stand.
class AutoConfirmOperator final : public Operator {
 public:
  /// `clears_safety_stops`: only for a simulated bench, where nobody can be hurt.
  explicit AutoConfirmOperator(bool clears_safety_stops = false) : clears_safety_stops_(clears_safety_stops) {}
  void clear_safety_stop(const std::string& reason) override;
  [[nodiscard]] bool run_again(const AnotherRun& question) override { return question.extra == 1; }
  [[nodiscard]] std::string name() const override { return "--yes"; }

 protected:
  void mount(const profiles::Propeller&, double, const std::string&) override {}
  void clear_stand(double, const std::string&) override {}

 private:
  const bool clears_safety_stops_;
};

/// Asks on a terminal; the person types the angle that was mounted. Waits without limit; a wrong angle is asked again,
/// "q" or end of file means no. Capitals and blanks around an answer do not matter.
class TerminalOperator final : public Operator {
 public:
  /// `stop_asked`: true after a signal. `terminal` outlives this.
  TerminalOperator(Terminal& terminal, std::FILE* words, std::function<bool()> stop_asked)
      : terminal_(terminal), words_(words), stop_asked_(std::move(stop_asked)) {}
  [[nodiscard]] bool run_again(const AnotherRun& question) override;
  void clear_safety_stop(const std::string& reason) override;
  void accept_doubts(const std::string& doubts) override;
  [[nodiscard]] std::string name() const override { return "terminal"; }

 protected:
  void mount(const profiles::Propeller& propeller, double occlusion_deg, const std::string& condition) override;
  void clear_stand(double speed_rpm, const std::string& condition) override;

 private:
  /// Asks until `accept` takes the answer; "q" at the end of the input. `about` explains the question and is printed
  /// the first time, with a `drawing` that is not recorded, `retort` ("You typed "{}"…") before it is asked again.
  void ask(std::string about, const std::string& question, const std::string& retort,
           const std::function<bool(const std::string& answer)>& accept, const std::string& drawing = "");
  Terminal& terminal_;
  std::FILE* words_;
  std::function<bool()> stop_asked_;
};

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
