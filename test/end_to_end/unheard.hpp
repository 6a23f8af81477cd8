// A computer that sleeps hears nothing: what is sent to it meanwhile is lost.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <string>
#include <system_error>

namespace kphi::test {

/// Throws away what waits in one socket if it takes datagrams.
inline void empty_datagrams(int socket) {
  int type = 0, domain = 0;
  socklen_t size = sizeof type;
  if (getsockopt(socket, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) return;
  if (getsockopt(socket, SOL_SOCKET, SO_DOMAIN, &domain, &size) != 0 || domain != AF_INET) return;
  char byte = 0;
  while (recv(socket, &byte, sizeof byte, MSG_DONTWAIT | MSG_TRUNC) >= 0) {
  }
}

/// Throws away the datagrams that wait for the process `pid`, which stands still.
inline void lose_what_came_for(int pid) {
  const auto process = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  if (process < 0) throw std::system_error(errno, std::generic_category(), "pidfd_open");
  for (const auto& entry : std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/fd")) {
    if (!std::filesystem::read_symlink(entry).string().starts_with("socket:")) continue;
    const auto socket = static_cast<int>(syscall(SYS_pidfd_getfd, process, std::stoi(entry.path().filename()), 0));
    if (socket < 0) throw std::system_error(errno, std::generic_category(), "pidfd_getfd");
    empty_datagrams(socket);
    close(socket);
  }
  close(process);
}

}  // namespace kphi::test
