#include "results/checked_heap.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "results/run_reader.hpp"
#include "test/results/recordings.hpp"
#include "test/results/synthetic_run.hpp"

namespace kphi::results::checked_heap_test {

using namespace test;
using testing::HasSubstr;

class CheckedHeap : public ::testing::Test {
 protected:
  CheckedHeap() {
    write_run(path_, make_run({}));
    make_writable(path_);
    whole_ = read_text(path_);
    for (std::size_t at = whole_.find(kBegin); at != whole_.npos; at = whole_.find(kBegin, at + 1))
      heaps_.push_back(at);
  }
  [[nodiscard]] std::uint64_t number_at(std::size_t place, std::size_t bytes = 8) const {
    std::uint64_t number = 0;
    std::memcpy(&number, whole_.data() + place, bytes);
    return number;
  }
  /// What a collection says of itself: version and size, index and length of each object.
  [[nodiscard]] std::vector<std::size_t> places_in(std::size_t heap) const {
    std::vector<std::size_t> places{heap + 4};
    const std::size_t end = heap + number_at(heap + 8);
    for (std::size_t at = heap + 16; at + 16 <= end && number_at(at, 2) != 0;
         at += 16 + (number_at(at + 8) + 7) / 8 * 8)
      for (const std::size_t byte : {0, 1, 9, 10, 11, 15}) places.push_back(at + byte);
    return places;
  }
  [[nodiscard]] bool is_sound(const std::string& bytes, std::size_t heap) const {
    return hdf5::is_sound_heap(std::as_bytes(std::span(bytes)).subspan(heap, number_at(heap + 8)));
  }

  static constexpr const char* kBegin = "GCOL\x01";
  TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_ / "a.h5";
  std::string whole_;
  std::vector<std::size_t> heaps_;
};

TEST_F(CheckedHeap, OfARunIsSound) {
  ASSERT_GE(heaps_.size(), 2u);
  for (const std::size_t heap : heaps_) EXPECT_TRUE(is_sound(whole_, heap)) << heap;
  EXPECT_TRUE(verify_run(path_).whole());
}

TEST_F(CheckedHeap, WithOneByteChangedInWhatItSaysOfItselfIsNot) {
  std::size_t changed = 0;
  for (const std::size_t heap : heaps_) {
    for (const std::size_t place : places_in(heap)) {
      for (const int bit : {1, 4, 128}) {
        std::string bytes = whole_;
        bytes[place] = static_cast<char>(bytes[place] ^ bit);
        EXPECT_FALSE(is_sound(bytes, heap)) << "byte " << place;
        ++changed;
      }
    }
  }
  EXPECT_GT(changed, 1000u);
}

TEST_F(CheckedHeap, OfAnySizeIsReadWithinItsBytes) {
  const std::string collection = whole_.substr(heaps_.at(0), number_at(heaps_.at(0) + 8));
  for (std::size_t size = 0; size <= collection.size(); size += 64) {
    const std::vector<char> cut(collection.begin(), collection.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_EQ(hdf5::is_sound_heap(std::as_bytes(std::span(cut))), size == collection.size()) << size;
  }
}

TEST_F(CheckedHeap, ThatIsDamagedMakesTheRunARefusal) {
  std::string bytes = whole_;
  for (const std::size_t heap : heaps_) bytes[heap + 16 + 10] = 0x62;  // its first text is said to be 6 MB long
  std::ofstream(path_, std::ios::binary) << bytes;
  try {
    (void)read_run(path_);
    FAIL() << "read";
  } catch (const RecordError& error) {
    EXPECT_THAT(error.what(), HasSubstr("its texts are damaged"));
  }
}

}  // namespace kphi::results::checked_heap_test
