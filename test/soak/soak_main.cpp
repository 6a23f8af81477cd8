// kphi_soak: many short campaigns, each from its seed, on all cores. A failing seed says what was mixed and what is
// wrong, and fails again alone.
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <map>
#include <thread>

#include "test/soak/soak_lives.hpp"

namespace {

using namespace kphi::soak;

const char* name_of(kphi::sim::PowerStage::Mode mode) {
  constexpr const char* kNames[] = {"coasts", "brakes", "drives"};
  return kNames[static_cast<std::size_t>(mode)];
}

struct Tally {
  std::array<std::uint64_t, 8> ends{};
  std::uint64_t failed = 0, resumed = 0, resumed_to_the_end = 0;
  std::uint64_t clean_steps = 0, clean_steps_in_doubt = 0;

  void add(const Tally& other) {
    for (std::size_t i = 0; i < ends.size(); ++i) ends[i] += other.ends[i];
    failed += other.failed;
    resumed += other.resumed;
    resumed_to_the_end += other.resumed_to_the_end;
    clean_steps += other.clean_steps;
    clean_steps_in_doubt += other.clean_steps_in_doubt;
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
      tally.clean_steps_in_doubt += verdict.clean_steps_in_doubt;
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
  tally.failed += wrong;
  if (!wrong && !talkative) return;
  if (wrong) text += fmt::format("again: ./run soak --seed {}\n\n", seed);
  fmt::print("{}", text);
  std::fflush(stdout);
}

/// Every `of`-th seed, in a process of its own: HDF5 has one lock for all threads.
int start_worker(std::uint64_t from, std::uint64_t to, unsigned of) {
  int ends[2];
  if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
  if (::fork() == 0) {
    ::close(ends[0]);
    Tally tally;
    for (std::uint64_t seed = from; seed < to; seed += of) live_one(seed, false, tally);
    const ssize_t told = ::write(ends[1], &tally, sizeof tally);
    ::_exit(told == sizeof tally ? 0 : 1);
  }
  ::close(ends[1]);
  return ends[0];
}

/// Adds what the worker found; a worker that died has failed.
void take_from(int worker, Tally& sum) {
  Tally tally;
  const bool whole = ::read(worker, &tally, sizeof tally) == sizeof tally;
  ::close(worker);
  if (whole) return sum.add(tally);
  ++sum.failed;
  fmt::print("a worker died\n");
}

Tally live_all(std::uint64_t from, std::uint64_t count) {
  const unsigned workers = std::max(1u, std::thread::hardware_concurrency());
  std::vector<int> pipes;
  for (unsigned i = 0; i < workers; ++i) pipes.push_back(start_worker(from + i, from + count, workers));
  Tally sum;
  for (const int pipe : pipes) take_from(pipe, sum);
  while (::wait(nullptr) > 0) {
  }
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
    fmt::print("{:6} of {} clean steps unsettled or drifting by chance\n", tally.clean_steps_in_doubt,
               tally.clean_steps);
    fmt::print("{:6} failed, of {} from seed {}\n", tally.failed, count, from);
  }
  return tally.failed == 0 && is_chance(tally.clean_steps_in_doubt, tally.clean_steps) ? 0 : 1;
}
