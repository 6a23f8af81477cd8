// The sentinel on every wire but the serial line, which end_to_end has: what is said when the program that started it
// dies, and nothing when it ends. Its program is another process here, as always.
#include "daq/sentinel/sentinel.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "test/results/recordings.hpp"
#include "test/soon.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::daq {
namespace sentinel_test {

using testing::AllOf;
using testing::HasSubstr;
using Wire = LastWord::Wire;

constexpr int kPatience_ms = 20'000;

bool readable(int file, int limit_ms = kPatience_ms) {
  pollfd wanted{file, POLLIN, 0};
  return ::poll(&wanted, 1, limit_ms) > 0;
}

/// A device on a free port of this computer.
class Device {
 public:
  explicit Device(Wire wire)
      : wire_(wire), socket_(::socket(AF_INET, wire == Wire::udp ? SOCK_DGRAM : SOCK_STREAM, 0)) {
    sockaddr_in here{};
    here.sin_family = AF_INET;
    here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof here;
    EXPECT_EQ(::bind(socket_.number(), reinterpret_cast<sockaddr*>(&here), size), 0);
    EXPECT_EQ(::getsockname(socket_.number(), reinterpret_cast<sockaddr*>(&here), &size), 0);
    if (wire == Wire::tcp) {
      EXPECT_EQ(::listen(socket_.number(), 8), 0);
    }
    port_ = ntohs(here.sin_port);
  }
  [[nodiscard]] LastWord word(std::string bytes, std::string answer = {}, std::string where = "localhost") const {
    return {"device", wire_, std::move(where), port_, std::move(bytes), std::move(answer)};
  }
  /// The next messages of one connection; "" after a long silence. Each is answered.
  [[nodiscard]] std::string heard(const std::string& answer = {}) const { return heard(std::vector{answer}); }
  [[nodiscard]] std::string heard(const std::vector<std::string>& answers) const {
    if (!readable(socket_.number())) return "";
    sockaddr_in there{};
    socklen_t size = sizeof there;
    const Descriptor connection(
        wire_ == Wire::tcp ? ::accept(socket_.number(), reinterpret_cast<sockaddr*>(&there), &size) : -1);
    const int from = wire_ == Wire::tcp ? connection.number() : socket_.number();
    std::string all;
    for (const std::string& answer : answers) {
      std::array<char, 64> bytes{};
      if (!readable(from)) return "";
      const ssize_t n = wire_ == Wire::tcp ? ::read(from, bytes.data(), bytes.size())
                                           : ::recvfrom(from, bytes.data(), bytes.size(), 0,
                                                        reinterpret_cast<sockaddr*>(&there), &size);
      speaker = ntohl(there.sin_addr.s_addr);
      if (!answer.empty()) {
        EXPECT_EQ(::write(from, answer.data(), answer.size()), static_cast<ssize_t>(answer.size()));
      }
      all.append(bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
    }
    return all;
  }
  mutable std::uint32_t speaker = 0;  ///< address of the last one that was heard
  [[nodiscard]] bool is_left_alone() const { return !readable(socket_.number(), 0); }

 private:
  Wire wire_;
  Descriptor socket_;
  std::uint16_t port_ = 0;
};

/// A program that starts a sentinel and ends by `end`; then `meanwhile`, and what the sentinel has
/// said once it has ended, too.
std::string let_a_program_end(const std::vector<LastWord>& words, void (*end)(Sentinel*),
                              const std::function<void()>& meanwhile = {}) {
  std::array<int, 2> said{};
  EXPECT_EQ(::pipe(said.data()), 0);
  const pid_t program = ::fork();
  if (program == 0) {
    ::dup2(said[1], STDERR_FILENO);
    ::close(said[0]);
    ::close(said[1]);
    end(new Sentinel(words));
    ::_exit(0);
  }
  ::close(said[1]);
  int status = 0;
  EXPECT_EQ(::waitpid(program, &status, 0), program);
  const Descriptor listening(said[0]);
  if (!meanwhile) return "";
  meanwhile();
  std::string all;
  std::array<char, 256> some;
  for (ssize_t n = 0; (n = ::read(said[0], some.data(), some.size())) > 0;)
    all.append(some.data(), static_cast<std::size_t>(n));
  return all;
}

void be_killed(Sentinel*) { ::raise(SIGKILL); }
void leave_without_a_word(Sentinel*) { ::_exit(3); }
void release(Sentinel* sentinel) { delete sentinel; }

TEST(Sentinel, SaysTheLastWordsOfAProgramThatWasKilled) {
  const Device box(Wire::udp), supply(Wire::tcp);
  const std::string stop("\x12\x34\0\0\0\0\0\0", 8), off("\0\1\0\0\0\6\1\6\0\x12\0\0", 12);
  let_a_program_end({box.word(stop), supply.word(off, off.substr(6))}, be_killed);
  EXPECT_EQ(box.heard(), stop);
  EXPECT_EQ(supply.heard(off), off);
}

TEST(Sentinel, SpeaksFromTheAddressOfTheBenchFile) {
  const Device box(Wire::udp), supply(Wire::tcp);
  std::vector<LastWord> words{box.word("stop"), supply.word("off", "off")};
  for (LastWord& word : words) word.where = "127.0.0.1", word.from = "127.0.0.3";
  let_a_program_end(words, be_killed);
  EXPECT_EQ(box.heard(), "stop");
  EXPECT_EQ(supply.heard("off"), "off");
  EXPECT_EQ(box.speaker, 0x7f000003u);
  EXPECT_EQ(supply.speaker, 0x7f000003u);
}

// A name may have several addresses, of which the device has one.
TEST(Sentinel, SaysThemAtEveryAddressOfTheDevice) {
  const Device box(Wire::udp), supply(Wire::tcp);
  const char* const all = "::1,127.0.0.2,127.0.0.1";
  let_a_program_end({box.word("stop", "", all), supply.word("off", "done", all)}, be_killed);
  EXPECT_EQ(box.heard(), "stop");
  EXPECT_EQ(supply.heard("done"), "off");
}

TEST(Sentinel, SaysThemAlsoOfOneThatLeftWithoutAWord) {
  const Device instrument(Wire::tcp);
  let_a_program_end({instrument.word("OUTP OFF\n")}, leave_without_a_word);
  EXPECT_EQ(instrument.heard(), "OUTP OFF\n");
}

TEST(Sentinel, RepeatsThemUntilTheyAreAcknowledged) {
  const Device supply(Wire::tcp);
  let_a_program_end({supply.word("off", "is off")}, be_killed);
  EXPECT_EQ(supply.heard("busy"), "off");
  EXPECT_EQ(supply.heard(), "off");
  EXPECT_EQ(supply.heard("it is off"), "off");
}

LastWord asked(const Device& supply) {
  LastWord word = supply.word("off", "done");
  word.question = "is it off?";
  word.proofs = {"no load", "yes"};
  return word;
}

/// The order and the question come on one connection.
void answer(const Device& supply, const std::string& to_order, const std::string& to_question) {
  EXPECT_EQ(supply.heard({to_order, to_question}), "offis it off?");
}

TEST(Sentinel, AsksTheDeviceWhetherItHasObeyed) {
  const Device supply(Wire::tcp);
  const std::string said = let_a_program_end({asked(supply)}, be_killed, [&] { answer(supply, "done", "yes"); });
  EXPECT_THAT(said, HasSubstr("device: switched off"));
}

TEST(Sentinel, SaysThatADeviceIsStillOnThatAcknowledgesWithoutObeying) {
  const Device supply(Wire::tcp);
  const std::string said = let_a_program_end({asked(supply)}, be_killed, [&] {
    for (int attempt = 0; attempt < 5; ++attempt) answer(supply, "done", "still on");
  });
  EXPECT_THAT(said, HasSubstr("IS STILL ON, switch it off by hand"));
}

class Watched : public testing::Test {
 protected:
  [[nodiscard]] bool is_replaced() {
    std::vector<std::string> news;
    return test::soon([&] {
      for (const std::string& line : sentinel_.take_news()) said_ += line + "\n";
      return !said_.empty();
    });
  }
  Device box_{Wire::udp};
  Sentinel sentinel_{{box_.word("stop")}};
  std::string said_;
};

TEST_F(Watched, IsReplacedAtOnceWhenItIsKilled) {
  const pid_t first = sentinel_.process();
  ASSERT_EQ(::kill(first, SIGKILL), 0);
  ASSERT_TRUE(is_replaced());
  EXPECT_EQ(said_, "sentinel: it was killed by signal 9; another one watches now\n");
  EXPECT_NE(sentinel_.process(), first);
  EXPECT_EQ(::kill(sentinel_.process(), 0), 0);
  EXPECT_EQ(sentinel_.failure(), "");
  EXPECT_TRUE(box_.is_left_alone()) << "its program lives";
}

TEST_F(Watched, IsReplacedWhenItStandsStill) {
  ASSERT_EQ(::kill(sentinel_.process(), SIGSTOP), 0);
  ASSERT_TRUE(is_replaced());
  EXPECT_EQ(said_, "sentinel: it did not answer; another one watches now\n");
}

TEST_F(Watched, DoesNotKeepItsProgramWhenItStandsStillInTheEnd) {
  const auto begun = std::chrono::steady_clock::now();
  {
    Sentinel stopped({box_.word("stop")});
    ASSERT_EQ(::kill(stopped.process(), SIGSTOP), 0);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(10));
  EXPECT_TRUE(box_.is_left_alone());
}

TEST_F(Watched, IsGivenUpWhenWhateverKillsItDoesNotEnd) {
  EXPECT_TRUE(test::soon([&] {
    if (const pid_t process = sentinel_.process(); process > 0) ::kill(process, SIGKILL);
    return !sentinel_.failure().empty();
  }));
  EXPECT_THAT(sentinel_.failure(), HasSubstr("install kphi again"));
}

TEST(Sentinel, ThatEndsAtOnceWatchesNothing) {
  const test::TemporaryFolder folder;
  std::filesystem::create_symlink("/bin/false", folder.path() / "kphi-sentinel");
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", folder.path().c_str(), 1);
  EXPECT_THAT(results::test::error_of<DeviceError>([] { const Sentinel sentinel({}); }),
              HasSubstr("it does not say that it watches"));
  ::setenv("PATH", path.c_str(), 1);
}

TEST(Sentinel, GoesOnToTheNextDeviceWhenOneIsGone) {
  std::optional<Device> gone(std::in_place, Wire::tcp);
  const LastWord nowhere = gone->word("off", "off");
  gone.reset();
  const Device supply(Wire::tcp);
  let_a_program_end({nowhere, supply.word("off", "off")}, be_killed);
  EXPECT_EQ(supply.heard("off"), "off");
}

TEST(Sentinel, SaysNothingOfAProgramThatReleasesIt) {
  const Device box(Wire::udp);
  pid_t process = 0;
  {
    const Sentinel sentinel({box.word("stop")});
    process = sentinel.process();
  }
  EXPECT_NE(::kill(process, 0), 0) << "still there";
  let_a_program_end({box.word("stop")}, release);
  EXPECT_TRUE(box.is_left_alone()) << "both sentinels have ended before";
}

TEST(Sentinel, LeavesADeviceAloneThatAnotherProgramHasTaken) {
  const test::TemporaryFolder folder;
  const Descriptor lock(::open((folder / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
  ASSERT_EQ(::flock(lock.number(), LOCK_EX | LOCK_NB), 0);
  const Device taken(Wire::udp), own(Wire::udp);
  LastWord of_taken = taken.word("stop");
  of_taken.lock = folder / "lock";
  let_a_program_end({of_taken, own.word("stop")}, be_killed);
  EXPECT_EQ(own.heard(), "stop");
  EXPECT_TRUE(taken.is_left_alone()) << "it would have been told before";
}

TEST(Sentinel, ThatIsNotInstalledIsAnErrorWithTheNextMove) {
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", "/nowhere", 1);
  EXPECT_THAT(results::test::error_of<DeviceError>([] { const Sentinel sentinel({}); }),
              AllOf(HasSubstr("No such file"), HasSubstr("install kphi again")));
  ::setenv("PATH", path.c_str(), 1);
}

}  // namespace sentinel_test
}  // namespace kphi::daq
