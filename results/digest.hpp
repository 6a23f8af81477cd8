// Whether bytes are as they were written: SHA-256, which everybody can check, and XXH128 (XXH3 of 128 bits,
// xxhash.com), which shows any accidental change as well and is taken of a run's samples each time they are read, for
// it is as quick as memory.
#pragma once

#include <cstddef>
#include <filesystem>
#include <future>
#include <memory>
#include <string>
#include <string_view>

#include "base/text.hpp"

struct evp_md_ctx_st;
struct XXH3_state_s;

namespace kphi::results {

class Sha256 {
 public:
  Sha256();
  void update(std::string_view bytes);
  /// 64 lower-case hex digits; the last call.
  [[nodiscard]] std::string hex();

 private:
  std::unique_ptr<evp_md_ctx_st, void (*)(evp_md_ctx_st*)> context_;
};

[[nodiscard]] std::string sha256(std::string_view bytes);

/// Throws RecordError if the file cannot be read to its end.
[[nodiscard]] std::string sha256_of_file(const std::filesystem::path& path);

class Xxh128 {
 public:
  Xxh128();
  void update(std::string_view bytes);
  /// Of the bytes so far: 32 lower-case hex digits, as xxh128sum prints them.
  [[nodiscard]] std::string hex() const;

 private:
  std::unique_ptr<XXH3_state_s, void (*)(XXH3_state_s*)> state_;
};

[[nodiscard]] std::string xxh128(std::string_view bytes);

/// A long text, read once, in blocks of whole lines, and hashed by a thread of its own. Throws RecordError as read_text
/// does.
class HashedText {
 public:
  HashedText(const std::filesystem::path& path, std::size_t most_bytes);
  /// Once; `this` must outlive it.
  [[nodiscard]] TextBlocks blocks();
  /// Of the blocks handed out; the last call.
  [[nodiscard]] std::string sha256();

 private:
  void hash(std::string_view block);

  std::filesystem::path path_;
  TextFile file_;
  Sha256 digest_;
  std::future<void> hashing_;  ///< of the block before
};

}  // namespace kphi::results
