// Preloaded into a program: a file system that refuses. KPHI_DISK names the folder below which it lies, KPHI_REFUSES
// what it refuses, with blanks between: words of kRefusals, of which each is what one kind of file system answers.
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

namespace {

struct Refusal {
  const char* word;
  int error;
};
constexpr Refusal kRefusals[] = {
    {"lock", ENOLCK},         // NFS without its lock daemon
    {"mode", EPERM},          // exFAT, FAT, CIFS: chmod
    {"folder-sync", EINVAL},  // CIFS, FUSE: fsync of a folder
    {"noreplace", EINVAL},    // FUSE: renameat2 with flags
    {"link", EPERM},          // exFAT, FAT
    {"rename", EIO},          // a disk that fails
    {"sync", EIO},            // likewise
    {"create", EROFS},        // mounted to be read
};

/// errno that is to be answered to this on this path; 0: nothing is refused.
int refused(const char* word, const std::string& path) {
  const char* const disk = std::getenv("KPHI_DISK");
  const char* const all = std::getenv("KPHI_REFUSES");
  if (disk == nullptr || all == nullptr || path.rfind(disk, 0) != 0) return 0;
  if ((" " + std::string(all) + " ").find(" " + std::string(word) + " ") == std::string::npos) return 0;
  for (const Refusal& refusal : kRefusals)
    if (std::string_view(word) == refusal.word) return refusal.error;
  return 0;
}

std::string absolute(const char* path) {
  if (path[0] == '/') return path;
  std::array<char, 4096> here{};
  return getcwd(here.data(), here.size()) == nullptr ? std::string(path) : std::string(here.data()) + "/" + path;
}

std::string path_of(int file) {
  std::array<char, 64> link{};
  std::snprintf(link.data(), link.size(), "/proc/self/fd/%d", file);
  std::array<char, 4096> path{};
  return readlink(link.data(), path.data(), path.size() - 1) < 0 ? std::string() : std::string(path.data());
}

bool is_folder(int file) {
  struct stat status {};
  return fstat(file, &status) == 0 && S_ISDIR(status.st_mode);
}

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

/// The answer of the file system, or its refusal.
template <class... Arguments>
int answer(const char* word, const std::string& path, const char* name, Arguments... arguments) {
  if (const int error = refused(word, path); error != 0) {
    errno = error;
    return -1;
  }
  return next<int (*)(Arguments...)>(name)(arguments...);
}

int opened(const char* name, const char* path, int flags, mode_t mode) {
  if ((flags & O_CREAT) == 0) return next<int (*)(const char*, int, ...)>(name)(path, flags, mode);
  if (const int error = refused("create", absolute(path)); error != 0) {
    errno = error;
    return -1;
  }
  return next<int (*)(const char*, int, ...)>(name)(path, flags, mode);
}

}  // namespace

extern "C" {

int flock(int file, int operation) { return answer("lock", path_of(file), "flock", file, operation); }
int chmod(const char* path, mode_t mode) noexcept { return answer("mode", absolute(path), "chmod", path, mode); }
int fchmodat(int folder, const char* path, mode_t mode, int flags) noexcept {
  return answer("mode", absolute(path), "fchmodat", folder, path, mode, flags);
}
int fchmod(int file, mode_t mode) noexcept { return answer("mode", path_of(file), "fchmod", file, mode); }
int fdatasync(int file) { return answer("sync", path_of(file), "fdatasync", file); }
int fsync(int file) { return answer(is_folder(file) ? "folder-sync" : "sync", path_of(file), "fsync", file); }
int mkdir(const char* path, mode_t mode) noexcept { return answer("create", absolute(path), "mkdir", path, mode); }
int link(const char* from, const char* to) noexcept { return answer("link", absolute(to), "link", from, to); }
int rename(const char* from, const char* to) noexcept { return answer("rename", absolute(to), "rename", from, to); }
int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) noexcept {
  for (const char* word : {"rename", "noreplace"})
    if (const int error = refused(word, absolute(to)); error != 0) {
      errno = error;
      return -1;
    }
  return next<int (*)(int, const char*, int, const char*, unsigned)>("renameat2")(from_folder, from, to_folder, to,
                                                                                  flags);
}
int open(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = va_arg(more, mode_t);
  va_end(more);
  return opened("open", path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = va_arg(more, mode_t);
  va_end(more);
  return opened("open64", path, flags, mode);
}
}
