#include "results/checksums.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <random>

#include "base/error.hpp"
#include "results/file_layer.hpp"
#include "test/fit/export/outside_reader.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::results {
namespace checksums_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Seal, HoldsWhatStandsAboveIt) {
  const std::string text = sealed("a: 1\nb: 2\n");
  EXPECT_THAT(text, testing::StartsWith("a: 1\nb: 2\n# sha256: "));
  EXPECT_NO_THROW(require_seal(text, "f.yaml"));
  EXPECT_NO_THROW(require_seal("a: 1\n", "f.yaml")) << "without a seal nothing is claimed";
  EXPECT_NO_THROW(require_seal("", "f.yaml"));
  EXPECT_THROW(require_seal(text + "c: 3\n", "f.yaml"), DataRejected) << "more below it";
}

TEST(Seal, ShowsAnyChangedByteAboveItAndInItsDigits) {
  const std::string text = sealed("k: 1.5e-6\nname: five inch\n");
  const std::size_t seal = text.find("# sha256: ");
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (at >= seal && at < seal + 10) continue;
    std::string changed = text;
    changed[at] = changed[at] == '7' ? '8' : '7';
    EXPECT_THROW(require_seal(changed, "f.yaml"), DataRejected) << at;
  }
}

TEST(Sums, AreThoseOfSha256sum) {
  const test::TemporaryFolder folder;
  kphi::test::write_file(folder.path() / "a.txt", "abc");
  std::filesystem::create_directory(folder.path() / "figures");
  kphi::test::write_file(folder.path() / "figures/b.svg", "<svg/>");
  const std::filesystem::path files[] = {folder.path() / "a.txt", folder.path() / "figures/b.svg"};
  record_sums(folder.path(), files);
  EXPECT_THAT(read_text(folder.path() / kSumsFile),
              HasSubstr("ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  a.txt\n"));
  EXPECT_THAT(read_text(folder.path() / kSumsFile), HasSubstr("  figures/b.svg\n"));
  EXPECT_THAT(unlike_sums(folder.path()), IsEmpty());
  kphi::test::write_file(folder.path() / "a.txt", "abd");
  EXPECT_THAT(unlike_sums(folder.path()), ElementsAre(HasSubstr("a.txt: changed since kphi wrote it")));
  record_sums(folder.path(), std::span(files, 1));
  EXPECT_EQ(read_sums(folder.path()).size(), 2u) << "the other entry stays";
  std::filesystem::remove(folder.path() / "figures/b.svg");
  EXPECT_THAT(unlike_sums(folder.path()), ElementsAre(HasSubstr("b.svg: missing, but in SHA256SUMS")));
}

TEST(Sums, AreOfFilesInTheFolderAlone) {
  const test::TemporaryFolder folder;
  const std::string any(64, '0');
  ASSERT_EQ(::mkfifo((folder.path() / "pipe").c_str(), 0600), 0);
  std::filesystem::create_symlink("/etc/passwd", folder.path() / "link");
  kphi::test::write_file(folder.path() / kSumsFile,
                         any + "  pipe\n" + any + "  link\n" + any + "  ../../etc/passwd\n" + any + "  /dev/zero\n");
  EXPECT_THAT(unlike_sums(folder.path()),
              testing::UnorderedElementsAre(HasSubstr("pipe: missing"), HasSubstr("link: missing"),
                                            HasSubstr("SHA256SUMS names a file outside the folder"),
                                            HasSubstr("SHA256SUMS names a file outside the folder")));
}

TEST(Sums, OfAnotherFormAreRefused) {
  const test::TemporaryFolder folder;
  EXPECT_THAT(unlike_sums(folder.path()), IsEmpty()) << "no list";
  for (const char* line : {"abc  a.txt\n", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad a.txt\n",
                           "BA7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  a.txt\n", "\n"}) {
    kphi::test::write_file(folder.path() / kSumsFile, line);
    EXPECT_THROW((void)read_sums(folder.path()), DataRejected) << line;
  }
}

}  // namespace checksums_test
}  // namespace kphi::results
