// Words that a blind mutator would seldom find, put in its way by LLVMFuzzerCustomMutator.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <span>
#include <string_view>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace kphi::test {

/// Every fourth time one of `tokens` is inserted, or written over what is there; else libFuzzer's own mutation.
inline std::size_t mutate_with(std::span<const std::string_view> tokens, std::uint8_t* data, std::size_t size,
                               std::size_t max_size, unsigned seed) {
  std::minstd_rand random(seed);
  if (random() % 4 != 0) return LLVMFuzzerMutate(data, size, max_size);
  const std::string_view token = tokens[random() % tokens.size()];
  if (token.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  const std::size_t at = random() % (size + 1);
  if (random() % 2 == 0 && at + token.size() <= size) {
    std::memcpy(data + at, token.data(), token.size());
    return size;
  }
  if (size + token.size() > max_size) size = max_size - token.size();
  const std::size_t place = at < size ? at : size;
  std::memmove(data + place + token.size(), data + place, size - place);
  std::memcpy(data + place, token.data(), token.size());
  return size + token.size();
}

}  // namespace kphi::test
