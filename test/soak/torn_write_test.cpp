#include "test/soak/torn_write.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "results/file_layer.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::soak::torn_write_test {

namespace fs = std::filesystem;

void write(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

/// Held before, written into by `act`, torn in a copy.
class Torn : public testing::Test {
 protected:
  Torn() {
    fs::create_directories(disk_);
    write(disk_ / "journal", "one\n");
    write(disk_ / "table", "abcdef");
  }
  template <class Act>
  std::string torn(const std::string& name, Act&& act, std::uint64_t seed = 1) {
    TornWrite write_in_pieces;
    write_in_pieces.before(disk_);
    act();
    fs::remove_all(copy_);
    fs::copy(disk_, copy_, fs::copy_options::recursive);
    write_in_pieces.tear(disk_, copy_, seed);
    return results::read_text(copy_ / name);
  }

  test::TemporaryFolder folder_;
  const fs::path disk_ = folder_ / "disk", copy_ = folder_ / "copy";
};

TEST_F(Torn, WhatIsAppendedEndsAnywhere) {
  std::set<std::size_t> lengths;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    write(disk_ / "journal", "one\n");
    const std::string text = torn(
        "journal", [&] { write(disk_ / "journal", "one\ntwo\n"); }, seed);
    EXPECT_TRUE(text.starts_with("one\n") && std::string("one\ntwo\n").starts_with(text)) << text;
    lengths.insert(text.size());
  }
  EXPECT_EQ(lengths.size(), 5u) << "nothing, each part, and all of it";
}

TEST_F(Torn, WhatIsWrittenOverIsNewUpToSomewhereAndOldBehindThat) {
  std::set<std::string> seen;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    write(disk_ / "table", "abcdef");
    seen.insert(torn(
        "table", [&] { write(disk_ / "table", "aXYZef"); }, seed));
  }
  EXPECT_EQ(seen, (std::set<std::string>{"abcdef", "aXcdef", "aXYdef", "aXYZef"}));
}

TEST_F(Torn, ANewNameIsNoWrite) {
  EXPECT_EQ(torn("other", [&] { fs::rename(disk_ / "table", disk_ / "other"); }), "abcdef");
}

TEST_F(Torn, OfTwoWrittenFilesNobodyKnowsWhichCameFirst) {
  EXPECT_EQ(torn("table",
                 [&] {
                   write(disk_ / "table", "x");
                   write(disk_ / "journal", "y");
                 }),
            "x");
}

}  // namespace kphi::soak::torn_write_test
