#include "results/file_layer.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>

#include "base/descriptor.hpp"
#include "base/number.hpp"
#include "base/text.hpp"

namespace kphi::results {
namespace {

[[noreturn]] void fail(const char* operation) { throw std::system_error(errno, std::generic_category(), operation); }

/// Throws std::system_error with `operation` if open(2) fails.
Descriptor opened(const std::filesystem::path& path, int flags, const char* operation) {
  Descriptor file(::open(path.empty() ? "." : path.c_str(), flags | O_CLOEXEC, 0666));
  if (file.number() < 0) fail(operation);
  return file;
}

}  // namespace

void write_all(int descriptor, std::string_view text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t n = ::write(descriptor, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail("write");
    done += static_cast<std::size_t>(n);
  }
}

void FileLayer::before_write(std::uint64_t) {}

void FileLayer::reserve(int descriptor, std::uint64_t offset, std::uint64_t bytes) {
  const int status =
      ::fallocate(descriptor, FALLOC_FL_KEEP_SIZE, static_cast<off_t>(offset), static_cast<off_t>(bytes));
  if (status != 0 && (errno == ENOSPC || errno == EDQUOT)) fail("fallocate");
}

void FileLayer::sync_data(int descriptor) {
  if (::fdatasync(descriptor) != 0) fail("fdatasync");
}

bool FileLayer::sync_folder(const std::filesystem::path& folder) {
  const Descriptor fd = opened(folder, O_RDONLY | O_DIRECTORY, "open folder");
  if (::fsync(fd.number()) == 0) return true;
  if (!is_unknown_there(errno)) fail("fsync folder");
  return false;
}

bool FileLayer::make_read_only(const std::filesystem::path& file) {
  struct stat now {};
  if (::stat(file.c_str(), &now) != 0) fail("stat");
  constexpr mode_t kWrite = S_IWUSR | S_IWGRP | S_IWOTH;
  if (::chmod(file.c_str(), now.st_mode & 07777 & ~kWrite) != 0) {
    if (!is_unknown_there(errno)) fail("chmod");
    return false;
  }
  return ::stat(file.c_str(), &now) == 0 && (now.st_mode & kWrite) == 0;  // some say yes, and do nothing
}

void FileLayer::rename(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return;
  if (errno != EINVAL && errno != ENOSYS) fail("rename");
  // File systems without RENAME_NOREPLACE: a hard link is as strict.
  if (::link(from.c_str(), to.c_str()) == 0) {
    if (::unlink(from.c_str()) != 0) fail("unlink");
    return;
  }
  if (!is_unknown_there(errno)) fail("link");
  // Nor links: nobody else writes into the folder, whose lock kphi has.
  if (std::filesystem::exists(to)) throw std::system_error(EEXIST, std::generic_category(), "rename");
  replace(from, to);
}

void FileLayer::replace(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (::rename(from.c_str(), to.c_str()) != 0) fail("rename");
}

std::uint64_t FileLayer::free_bytes(const std::filesystem::path& folder) {
  struct statvfs info {};
  if (::statvfs(folder.empty() ? "." : folder.c_str(), &info) != 0) fail("statvfs");
  return static_cast<std::uint64_t>(info.f_bavail) * info.f_frsize;
}

void MemoryOnlySync::sync_data(int) {}
bool MemoryOnlySync::sync_folder(const std::filesystem::path&) { return true; }

bool is_unknown_there(int error) noexcept {
  return error == EPERM || error == EINVAL || error == ENOSYS || error == EOPNOTSUPP;
}

FileLayer& disk() {
  static FileLayer layer;
  return layer;
}

void require_room(const std::filesystem::path& folder, std::uint64_t bytes, FileLayer& files) {
  const std::uint64_t free = on_disk(folder.string(), [&] { return files.free_bytes(folder); });
  if (free >= bytes) return;
  throw RecordError(fmt::format("disk full: {}: {} needed, {} free, {} too few; make room or choose another folder",
                                folder.string(), bytes_in_words(bytes), bytes_in_words(free),
                                bytes_in_words(bytes - free)));
}

std::filesystem::path free_name(const std::string& name, const std::string& ending) {
  std::filesystem::path path = name + ending;
  for (int i = 2; std::filesystem::exists(path); ++i) path = fmt::format("{}-{}{}", name, i, ending);
  return path;
}

void sync_file(const std::filesystem::path& path, FileLayer& files) {
  files.sync_data(opened(path, O_RDONLY, "open").number());
}

ReplacedFile::ReplacedFile(std::filesystem::path path, FileLayer& files)
    : path_(std::move(path)), part_(path_.string() + ".part"), files_(files) {
  on_disk(path_.string(), [&] { descriptor_ = opened(part_, O_WRONLY | O_CREAT | O_TRUNC, "open"); });
}

ReplacedFile::~ReplacedFile() {
  if (!finished_) ::unlink(part_.c_str());
}

void ReplacedFile::append(std::string_view text) {
  on_disk(path_.string(), [&] {
    files_.before_write(text.size());
    write_all(descriptor_.number(), text);
  });
}

void ReplacedFile::finish() {
  on_disk(path_.string(), [&] {
    files_.sync_data(descriptor_.number());
    files_.replace(part_, path_);
    finished_ = true;
    files_.sync_folder(path_.parent_path());
  });
}

void write_text(const std::filesystem::path& path, const std::string& text, FileLayer& files) {
  ReplacedFile file(path, files);
  file.append(text);
  file.finish();
}

std::string read_text(const std::filesystem::path& path, std::size_t most_bytes) {
  return reading(path, [&] { return read_text_file(path, most_bytes); });
}

std::string failure_text(const std::string& where, int error) {
  const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
  return fmt::format("{}{}: {}{}", full ? "disk full: " : "", where, std::generic_category().message(error),
                     full ? "; make room or choose another folder" : "");
}

}  // namespace kphi::results
