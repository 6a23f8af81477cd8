#include "results/digest.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "base/error.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::results {
namespace {

using kphi::test::TemporaryFolder;

TEST(Digest, KnowsTheStandardsExamples) {  // FIPS 180-2, appendix B.1
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST(Digest, OfAFileIsThatOfItsBytes) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a") << std::string(1'000'000, 'a');
  EXPECT_EQ(sha256_of_file(folder / "a"), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  EXPECT_THROW((void)sha256_of_file(folder / "nothing"), RecordError);
  EXPECT_THROW((void)sha256_of_file(folder.path()), RecordError) << "a folder";
}

TEST(Digest, OfXxh128IsWhatXxh128sumPrints) {
  EXPECT_EQ(xxh128(""), "99aa06d3014798d86001c324468d497f");
  EXPECT_EQ(xxh128("abc"), "06b05ab6733a618578af5f94892f3950");
  const std::string million(1'000'000, 'a');
  EXPECT_EQ(xxh128(million), "a545df8e384a9579b1fd6fae5285c4eb");
  Xxh128 digest;
  for (std::size_t at = 0; at < million.size(); at += at + 1) digest.update(million.substr(at, at + 1));
  EXPECT_EQ(digest.hex(), xxh128(million)) << "in pieces";
}

}  // namespace
}  // namespace kphi::results
