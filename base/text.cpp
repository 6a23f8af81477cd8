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

std::string read_text_file(const std::filesystem::path& path, std::size_t most_bytes) {
  const auto fail = [](const char* what, const char* next_move) {
    throw std::runtime_error(fmt::format("{}: {}; {}", what, std::strerror(errno), next_move));
  };
  // O_NONBLOCK: a pipe that nobody writes to must not keep the program waiting before it is refused.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.number() < 0) fail("cannot be opened", "check the name");
  struct stat about {};
  if (::fstat(file.number(), &about) != 0) fail("cannot be read", "check the disk");
  if (S_ISDIR(about.st_mode)) throw std::runtime_error("is a folder; name a file");
  if (!S_ISREG(about.st_mode)) throw std::runtime_error("is a pipe or a device; name a file");
  std::string text;
  for (std::size_t size = 0;;) {
    if (size == text.size())
      text.resize(std::min(most_bytes + 1, std::max(2 * size, static_cast<std::size_t>(about.st_size) + 1)));
    const ssize_t got = ::read(file.number(), text.data() + size, text.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail("cannot be read", "check the disk");
    size += static_cast<std::size_t>(got);
    if (size > most_bytes)
      throw std::runtime_error(
          fmt::format("is larger than {} MiB; check that this is the right file", most_bytes >> 20));
    if (got > 0) continue;
    text.resize(size);
    return text;
  }
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

}  // namespace kphi
