#include "base/text.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/locale/utf.hpp>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "base/descriptor.hpp"

namespace kphi {

namespace {

constexpr std::size_t kBlock = std::size_t{1} << 20, kSmallBlock = std::size_t{1} << 12;
constexpr const char* kTooLong = "has a line of more than 1 MiB; check that this is the right file";

[[noreturn]] void fail(const char* what, const char* next_move) {
  throw std::runtime_error(fmt::format("{}: {}; {}", what, std::strerror(errno), next_move));
}

}  // namespace

// O_NONBLOCK: a pipe that nobody writes to must not keep the program waiting before it is refused.
TextFile::TextFile(const std::filesystem::path& path, std::size_t most_bytes)
    : file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)), most_bytes_(most_bytes) {
  if (file_.number() < 0) fail("cannot be opened", "check the name");
  struct stat about {};
  if (::fstat(file_.number(), &about) != 0) fail("cannot be read", "check the disk");
  if (S_ISDIR(about.st_mode)) throw std::runtime_error("is a folder; name a file");
  if (!S_ISREG(about.st_mode)) throw std::runtime_error("is a pipe or a device; name a file");
  size_ = static_cast<std::size_t>(about.st_size);
}

std::size_t TextFile::read_more() {
  const std::size_t size = bytes_.size();
  const std::size_t wanted = std::clamp(size_ - std::min(read_, size_), kSmallBlock, kBlock);
  bytes_.resize(size + wanted);
  ssize_t got = 0;
  while ((got = ::read(file_.number(), bytes_.data() + size, wanted)) < 0 && errno == EINTR) {
  }
  if (got < 0) fail("cannot be read", "check the disk");
  bytes_.resize(size + static_cast<std::size_t>(got));
  read_ += static_cast<std::size_t>(got);
  if (read_ > most_bytes_)
    throw std::runtime_error(
        fmt::format("is larger than {} MiB; check that this is the right file", most_bytes_ >> 20));
  return static_cast<std::size_t>(got);
}

std::string_view TextFile::next_block() {
  bytes_.erase(0, given_);
  std::size_t searched = bytes_.size();
  while (read_more() > 0) {
    const std::size_t last = std::string_view(bytes_).substr(searched).rfind('\n');
    if (last != std::string_view::npos) {
      given_ = searched + last + 1;
      return std::string_view(bytes_).substr(0, given_);
    }
    searched = bytes_.size();
    if (searched > kLongestLine) throw std::runtime_error(kTooLong);
  }
  given_ = bytes_.size();
  return bytes_;
}

std::string TextFile::rest() {
  bytes_.erase(0, std::exchange(given_, 0));
  while (read_more() > 0) {
  }
  return std::move(bytes_);
}

std::string read_text_file(const std::filesystem::path& path, std::size_t most_bytes) {
  TextFile file(path, most_bytes);
  std::string text;
  for (std::string_view block = file.next_block(); !block.empty(); block = file.next_block()) text += block;
  return text;
}

bool next_line(std::istream& in, std::string& line) {
  line.clear();
  for (std::streambuf& from = *in.rdbuf();;) {
    const int c = from.sbumpc();
    if (c == std::streambuf::traits_type::eof()) break;
    if (c == '\n') return true;
    line += static_cast<char>(c);
    if (line.size() > kLongestLine) throw std::runtime_error(kTooLong);
  }
  return !line.empty();
}

std::string printable(std::string_view text, LineEnds line_ends) {
  using Utf8 = boost::locale::utf::utf_traits<char>;
  std::string out;
  for (auto at = text.begin(); at != text.end();) {
    auto end = at;
    const auto code = Utf8::decode(end, text.end());
    const bool is_kept = code == '\n' && line_ends == LineEnds::keep;
    const bool control = code < 0x20 || (code >= 0x7F && code < 0xA0);
    if ((control && !is_kept) || !boost::locale::utf::is_valid_codepoint(code)) {
      out += "\xEF\xBF\xBD";
      ++at;
    } else {
      out.append(at, end);
      at = end;
    }
  }
  return out;
}

std::string in_quotes(std::string_view foreign) {
  constexpr std::size_t kShown = 80;
  const bool is_cut = foreign.size() > kShown;
  return '"' + printable(foreign.substr(0, kShown)) + (is_cut ? "…\"" : "\"");
}

}  // namespace kphi
