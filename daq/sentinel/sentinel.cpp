#include "daq/sentinel/sentinel.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <netdb.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "base/error.hpp"
#include "base/thread.hpp"

namespace kphi::daq {
namespace {

constexpr const char* kProgram = "kphi-sentinel";
constexpr const char* kInstall =
    "install kphi again: kphi-sentinel belongs beside it, or into ../libexec/kphi; without it a program that is killed "
    "leaves the supply on";
constexpr char kReleased = '.', kAsked = '?', kHere = '!';  // on the line to it, and back
constexpr std::chrono::milliseconds kAskEvery{500}, kPatience{1000};
constexpr int kMostReplaced = 10;  // of one program: whoever kills them does not want one

[[noreturn]] void fail(int error, const std::string& doing) {
  throw DeviceError("sentinel", doing, std::generic_category().message(error), kInstall);
}

std::string path_of_program() {
  std::error_code none;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", none).parent_path();
  for (const auto& place : {folder / kProgram, (folder / "../libexec/kphi" / kProgram).lexically_normal()})
    if (std::filesystem::exists(place, none)) return place.string();
  return kProgram;
}

std::string in_hex(const std::string& bytes) {
  return fmt::format("{:02x}", fmt::join(std::vector<std::uint8_t>(bytes.begin(), bytes.end()), ""));
}

/// All addresses of its name, by number and with commas, since the sentinel asks no name server: the first one need not
/// be that at which the device listens.
std::string address_of(const LastWord& word) {
  if (word.wire == LastWord::Wire::serial || word.wire == LastWord::Wire::usb) return word.where;
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(word.where.c_str(), nullptr, &wanted, &found) != 0) return word.where;
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> all(found, &freeaddrinfo);
  std::string addresses;
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    std::array<char, NI_MAXHOST> text{};
    if (::getnameinfo(one->ai_addr, one->ai_addrlen, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST) == 0)
      addresses += (addresses.empty() ? "" : ",") + std::string(text.data());
  }
  return addresses.empty() ? word.where : addresses;
}

/// With commas.
std::string in_hex(const std::vector<std::string>& all) {
  std::string text;
  for (const std::string& bytes : all) text += (text.empty() ? "" : ",") + in_hex(bytes);
  return text;
}

std::vector<std::string> arguments_of(const std::vector<LastWord>& words) {
  constexpr std::array kWires{"udp", "tcp", "serial", "usb"};
  std::vector<std::string> all{kProgram};
  for (const LastWord& word : words)
    all.insert(all.end(), {word.device, kWires.at(static_cast<std::size_t>(word.wire)), address_of(word),
                           std::to_string(word.number), in_hex(word.bytes), in_hex(word.answer), in_hex(word.question),
                           in_hex(word.proofs), word.from, word.lock});
  return all;
}

/// False: nothing came in time.
bool is_heard(int line, std::chrono::milliseconds limit) {
  pollfd wanted{line, POLLIN, 0};
  return ::poll(&wanted, 1, static_cast<int>(limit.count())) > 0;
}

/// How it ended; empty: it did not within `limit`.
std::string awaited(pid_t process, std::chrono::milliseconds limit) {
  for (const auto give_up = std::chrono::steady_clock::now() + limit;;) {
    int status = 0;
    if (const pid_t ended = ::waitpid(process, &status, WNOHANG); ended != 0)
      return ended == process && WIFSIGNALED(status) ? fmt::format("it was killed by signal {}", WTERMSIG(status))
                                                     : std::string("it ended");
    if (std::chrono::steady_clock::now() > give_up) return "";
    ::poll(nullptr, 0, 1);
  }
}

}  // namespace

Sentinel::Sentinel(const std::vector<LastWord>& words) : arguments_(arguments_of(words)) {
  start();
  thread_ = start_thread({"sentinel"}, [this] { watch(); });
}

Sentinel::~Sentinel() {
  quit_.raise();
  thread_.join();
  end();
}

void Sentinel::start() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) fail(errno, "start");
  line_ = Descriptor(ends[0]);
  {
    const Descriptor its(ends[1]);
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    ::posix_spawn_file_actions_init(&files);
    ::posix_spawn_file_actions_adddup2(&files, its.number(), STDIN_FILENO);
    ::posix_spawnattr_init(&attributes);
    // Ctrl-C at the terminal is not for it; the thread that starts it blocks all signals.
    ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK);
    sigset_t none;
    sigemptyset(&none);
    ::posix_spawnattr_setsigmask(&attributes, &none);
    std::vector<char*> pointers;
    for (const std::string& argument : arguments_) pointers.push_back(const_cast<char*>(argument.c_str()));
    pointers.push_back(nullptr);
    pid_t process = -1;
    const int error =
        ::posix_spawnp(&process, path_of_program().c_str(), &files, &attributes, pointers.data(), environ);
    ::posix_spawn_file_actions_destroy(&files);
    ::posix_spawnattr_destroy(&attributes);
    if (error != 0) fail(error, "start");
    process_ = process;
  }
  char ready = 0;
  if (is_heard(line_.number(), kPatience) && ::recv(line_.number(), &ready, 1, 0) == 1 && ready == kHere) return;
  end();
  throw DeviceError("sentinel", "start", "it does not say that it watches", kInstall);
}

void Sentinel::end() noexcept {
  const pid_t process = process_.exchange(-1);
  if (process <= 0) return;
  (void)!::send(line_.number(), &kReleased, 1, MSG_NOSIGNAL | MSG_DONTWAIT);
  if (!awaited(process, kPatience).empty()) return;
  // Stopped, by whomever: it has nothing to say any more.
  ::kill(process, SIGKILL);
  ::waitpid(process, nullptr, 0);
}

std::string Sentinel::ask() {
  char answer = 0;
  (void)!::send(line_.number(), &kAsked, 1, MSG_NOSIGNAL | MSG_DONTWAIT);
  if (is_heard(line_.number(), kPatience)) {
    if (::recv(line_.number(), &answer, 1, 0) == 1) return "";
    if (const std::string how = awaited(process_, kPatience); !how.empty()) return how;
  }
  return "it did not answer";
}

void Sentinel::watch() noexcept {
  for (;;) {
    // Whatever comes unasked is its end.
    pollfd waiting[2] = {{quit_.descriptor(), POLLIN, 0}, {line_.number(), POLLIN, 0}};
    ::poll(waiting, 2, static_cast<int>(kAskEvery.count()));
    if (waiting[0].revents != 0) return;
    try {
      if (const std::string why = ask(); !why.empty()) replace(why);
    } catch (const std::exception& error) {
      const std::lock_guard lock(mutex_);
      failure_ = error.what();
      has_failed_ = true;
      return;
    }
  }
}

void Sentinel::replace(const std::string& why) {
  if (const pid_t process = process_.exchange(-1); process > 0) {
    ::kill(process, SIGKILL);  // one that is stopped
    ::waitpid(process, nullptr, 0);
  }
  if (++replaced_ > kMostReplaced) throw DeviceError("sentinel", "watch", why + ", again and again", kInstall);
  start();
  const std::lock_guard lock(mutex_);
  news_.push_back("sentinel: " + why + "; another one watches now");
}

std::string Sentinel::failure() const {
  if (!has_failed_) return "";
  const std::unique_lock lock(mutex_, std::try_to_lock);
  return lock ? failure_ : "the sentinel is gone";
}

std::vector<std::string> Sentinel::take_news() {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  return lock ? std::exchange(news_, {}) : std::vector<std::string>();
}

}  // namespace kphi::daq
