#include "daq/sentinel/sentinel.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <netdb.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "base/error.hpp"

namespace kphi::daq {
namespace {

constexpr const char* kProgram = "kphi-sentinel";

[[noreturn]] void fail(int error, const std::string& doing) {
  throw DeviceError("sentinel", doing, std::generic_category().message(error),
                    fmt::format("install kphi again: {} belongs beside it, or into ../libexec/kphi; without it a "
                                "program that is killed leaves "
                                "the supply on",
                                kProgram));
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

std::vector<std::string> arguments_of(const std::vector<LastWord>& words) {
  constexpr std::array kWires{"udp", "tcp", "serial", "usb"};
  std::vector<std::string> all{kProgram};
  for (const LastWord& word : words)
    all.insert(all.end(), {word.device, kWires.at(static_cast<std::size_t>(word.wire)), address_of(word),
                           std::to_string(word.number), in_hex(word.bytes), in_hex(word.answer), word.from, word.lock});
  return all;
}

}  // namespace

Sentinel::Sentinel(const std::vector<LastWord>& words) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) fail(errno, "start");
  line_ = Descriptor(ends[0]);
  const Descriptor its(ends[1]);
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawn_file_actions_adddup2(&files, its.number(), STDIN_FILENO);
  ::posix_spawnattr_init(&attributes);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);  // Ctrl-C at the terminal is not for it
  std::vector<std::string> arguments = arguments_of(words);
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  const int error = ::posix_spawnp(&process_, path_of_program().c_str(), &files, &attributes, pointers.data(), environ);
  ::posix_spawn_file_actions_destroy(&files);
  ::posix_spawnattr_destroy(&attributes);
  if (error != 0) fail(error, "start");
}

Sentinel::~Sentinel() {
  const char released = '.';
  (void)!::send(line_.number(), &released, 1, MSG_NOSIGNAL);
  ::waitpid(process_, nullptr, 0);
}

}  // namespace kphi::daq
