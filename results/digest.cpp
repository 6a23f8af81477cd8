#include "results/digest.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <array>
#include <cerrno>
#include <new>
#include <vector>

#include "base/descriptor.hpp"
#include "base/error.hpp"
#include "base/ordered_work.hpp"
#include "results/file_layer.hpp"
#ifdef __x86_64__
#include <xxh_x86dispatch.h>  // XXH3 in the widest registers of the processor it runs on
#endif

namespace kphi::results {

namespace {

/// Without its configuration file and its error texts, which a short command would spend a tenth of its time on.
void start_openssl() {
  static const int started = OPENSSL_init_crypto(OPENSSL_INIT_NO_LOAD_CONFIG | OPENSSL_INIT_NO_LOAD_CRYPTO_STRINGS |
                                                     OPENSSL_INIT_NO_ADD_ALL_CIPHERS | OPENSSL_INIT_NO_ADD_ALL_DIGESTS,
                                                 nullptr);
  (void)started;
}

void check(bool ok) {
  if (!ok) throw RecordError("OpenSSL: SHA-256 is not available; check the OpenSSL configuration");
}

}  // namespace

Sha256::Sha256() : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
  start_openssl();
  check(context_ != nullptr && EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1);
}

void Sha256::update(std::string_view bytes) {
  check(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()) == 1);
}

std::string Sha256::hex() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> raw{};
  unsigned size = 0;
  check(EVP_DigestFinal_ex(context_.get(), raw.data(), &size) == 1);
  return fmt::format("{:02x}", fmt::join(raw.begin(), raw.begin() + size, ""));
}

std::string sha256(std::string_view bytes) {
  Sha256 digest;
  digest.update(bytes);
  return digest.hex();
}

std::string sha256_of_file(const std::filesystem::path& path) {
  // A pipe or a device would keep the program waiting, or never end.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat about {};
  if (file.number() < 0 || ::fstat(file.number(), &about) != 0) throw RecordError(failure_text(path.string(), errno));
  if (!S_ISREG(about.st_mode)) throw RecordError(path.string() + ": is a folder, a pipe or a device, not a file");
  Sha256 digest;
  std::vector<char> block(1 << 18);
  for (ssize_t n = 0; (n = ::read(file.number(), block.data(), block.size())) != 0;) {
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw RecordError(failure_text(path.string(), errno));
    digest.update({block.data(), static_cast<std::size_t>(n)});
  }
  return digest.hex();
}

Xxh128::Xxh128() : state_(XXH3_createState(), [](XXH3_state_s* state) { XXH3_freeState(state); }) {
  if (!state_) throw std::bad_alloc();
  XXH3_128bits_reset(state_.get());
}

void Xxh128::update(std::string_view bytes) { XXH3_128bits_update(state_.get(), bytes.data(), bytes.size()); }

std::string Xxh128::hex() const {
  const XXH128_hash_t hash = XXH3_128bits_digest(state_.get());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

std::string xxh128(std::string_view bytes) {
  Xxh128 digest;
  digest.update(bytes);
  return digest.hex();
}

HashedText::HashedText(const std::filesystem::path& path, std::size_t most_bytes)
    : path_(path), file_(reading(path, [&] { return TextFile(path, most_bytes); })) {}

TextBlocks HashedText::blocks() {
  return {[this] {
            const std::string_view block = reading(path_, [this] { return file_.next_block(); });
            hash(block);
            return block;
          },
          file_.size()};
}

void HashedText::hash(std::string_view block) {
  if (hashing_.valid()) hashing_.get();
  hashing_ = std::async(launch_for(block.size()), [this, text = std::string(block)] { digest_.update(text); });
}

std::string HashedText::sha256() {
  if (hashing_.valid()) hashing_.get();
  return digest_.hex();
}

}  // namespace kphi::results
