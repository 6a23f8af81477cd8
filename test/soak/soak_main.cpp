// kphi_soak: many short campaigns, each from its seed, on all cores. A failing seed says what was mixed and what is
// wrong, and fails again alone.
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <csignal>
#include <thread>

#include "test/soak/soak_verdict.hpp"

namespace {

using namespace kphi::soak;

const char* name_of(kphi::sim::PowerStage::Mode mode) {
  constexpr const char* kNames[] = {"coasts", "brakes", "drives"};
  return kNames[static_cast<std::size_t>(mode)];
}

struct Tally {
  std::array<std::uint64_t, 8> ends{};
  std::uint64_t lived = 0, failed = 0, resumed = 0, resumed_to_the_end = 0;
  std::uint64_t clean_steps = 0, clean_steps_flagged = 0;

  void add(const Tally& other) {
    for (std::size_t i = 0; i < ends.size(); ++i) ends[i] += other.ends[i];
    lived += other.lived;
    failed += other.failed;
    resumed += other.resumed;
    resumed_to_the_end += other.resumed_to_the_end;
    clean_steps += other.clean_steps;
    clean_steps_flagged += other.clean_steps_flagged;
  }
};

/// How a life went, line by line.
std::string told(const Story& story) {
  std::string text;
  for (const std::string& line : story.said) text += "\n#     " + line;
  for (const auto& stream : story.streams)
    text +=
        fmt::format("\n#     {:.4f} s: a stream, {} datagrams", kphi::to_seconds(stream.began), stream.arrivals.size());
  for (const auto& change : story.stages)
    text += fmt::format("\n#     {:.4f} s: {}", kphi::to_seconds(change.at), name_of(change.mode));
  return text;
}

/// One campaign with all its lives; words on stdout when something is wrong, or always if `talkative`.
void live_one(std::uint64_t seed, bool talkative, Tally& tally) {
  std::string text;
  bool wrong = false;
  try {
    live_through(seed, [&](const Evidence& evidence, const Verdict& verdict) {
      const Story& story = evidence.story;
      tally.clean_steps += verdict.clean_steps;
      tally.clean_steps_flagged += verdict.clean_steps_flagged;
      ++tally.ends[static_cast<std::size_t>(story.end)];
      tally.resumed += evidence.mixture.life > 1;
      tally.resumed_to_the_end += evidence.mixture.life > 1 && story.end == End::finished;
      text += words(evidence.mixture) + fmt::format("# {} at {:.3f} s {}{}\n", name_of(story.end),
                                                    kphi::to_seconds(story.ended), story.reason,
                                                    talkative ? told(story) : "");
      for (const std::string& line : verdict.wrong) text += "WRONG " + line + "\n";
      wrong = wrong || !verdict.wrong.empty();
    });
  } catch (const std::exception& error) {
    text += fmt::format("WRONG seed {}: an exception: {}\n", seed, error.what());
    wrong = true;
  }
  ++tally.lived;
  tally.failed += wrong;
  if (!wrong && !talkative) return;
  if (wrong) text += fmt::format("again: ./run soak --seed {}\n\n", seed);
  fmt::print("{}", text);
  std::fflush(stdout);
}

volatile std::sig_atomic_t g_stop = 0;

/// Every `of`-th seed, in a process of its own: HDF5 has one lock for all threads. What each seed adds goes into the
/// pipe, in one write.
pid_t start_worker(std::uint64_t from, std::uint64_t to, unsigned of, const int (&pipe)[2]) {
  const pid_t worker = ::fork();
  if (worker != 0) return worker;
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_DFL);
  ::close(pipe[0]);
  for (std::uint64_t seed = from; seed < to; seed += of) {
    Tally tally;
    live_one(seed, false, tally);
    if (::write(pipe[1], &tally, sizeof tally) != sizeof tally) ::_exit(1);
  }
  ::_exit(0);
}

/// On a terminal one line that stays, elsewhere a line for every five hundred.
void show_progress(const Tally& sum, std::uint64_t count) {
  const bool terminal = ::isatty(STDERR_FILENO) != 0;
  if (!terminal && sum.lived % 500 != 0) return;
  fmt::print(stderr, "{}{} of {} lived, {} failed{}", terminal ? "\r" : "", sum.lived, count, sum.failed,
             terminal && sum.lived < count ? "" : "\n");
}

Tally live_all(std::uint64_t from, std::uint64_t count) {
  struct sigaction stop {};
  stop.sa_handler = [](int) { g_stop = 1; };
  ::sigaction(SIGINT, &stop, nullptr);
  ::sigaction(SIGTERM, &stop, nullptr);
  int pipe[2];
  if (::pipe(pipe) != 0) throw std::runtime_error("no pipe");
  const unsigned of = std::max(1u, std::thread::hardware_concurrency());
  std::vector<pid_t> workers;
  for (unsigned i = 0; i < of; ++i) workers.push_back(start_worker(from + i, from + count, of, pipe));
  ::close(pipe[1]);
  Tally sum, seed;
  while (g_stop == 0 && ::read(pipe[0], &seed, sizeof seed) == sizeof seed) {
    sum.add(seed);
    show_progress(sum, count);
  }
  for (const pid_t worker : workers) {
    if (g_stop != 0) ::kill(worker, SIGTERM);
    ::waitpid(worker, nullptr, 0);
  }
  ::close(pipe[0]);
  return sum;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("short campaigns on the deterministic bench with random faults of every device");
  std::optional<std::uint64_t> seed;
  std::uint64_t from = 1, count = 10'000;
  app.add_option("--seed", seed, "this one only, and tell all of it");
  app.add_option("--from", from, "first seed")->capture_default_str();
  app.add_option("--count", count, "so many of them")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  Tally tally;
  if (seed) {
    live_one(*seed, true, tally);
  } else {
    tally = live_all(from, count);
    for (std::size_t i = 0; i < tally.ends.size(); ++i)
      if (tally.ends[i] > 0) fmt::print("{:6} {}\n", tally.ends[i], name_of(static_cast<End>(i)));
    fmt::print("{:6} lives were resumed, {} of them to the end of the campaign\n", tally.resumed,
               tally.resumed_to_the_end);
    fmt::print("{:6} of {} clean steps unsettled or drifting by chance\n", tally.clean_steps_flagged,
               tally.clean_steps);
    fmt::print("{:6} failed, of {} from seed {}\n", tally.failed, tally.lived, from);
    if (tally.lived < count)
      fmt::print("{:6} did not live: {}\n", count - tally.lived, g_stop != 0 ? "stopped" : "a worker died");
  }
  return tally.failed == 0 && tally.lived == (seed ? 1 : count) &&
                 is_chance(tally.clean_steps_flagged, tally.clean_steps)
             ? 0
             : 1;
}
