// Memory in huge pages, where the system has them: the first touch of each small one takes longer than filling it.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <new>

namespace kphi {

/// An allocator. What is smaller than a huge page lies in small ones.
template <class T>
struct HugePages {
  using value_type = T;
  T* allocate(std::size_t n) {
    constexpr std::size_t kPage = 2u << 20;
    const bool huge = n * sizeof(T) >= kPage;
    const std::size_t bytes = huge ? (n * sizeof(T) + kPage - 1) / kPage * kPage : n * sizeof(T);
    void* memory = huge ? std::aligned_alloc(kPage, bytes) : std::malloc(bytes);
    if (memory == nullptr) throw std::bad_alloc();
    if (huge) ::madvise(memory, bytes, MADV_HUGEPAGE);
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t) { std::free(memory); }
  /// Without a value: what is overwritten before it is read needs no zeros.
  void construct(T* number) { ::new (number) T; }
  bool operator==(const HugePages&) const = default;
};

}  // namespace kphi
