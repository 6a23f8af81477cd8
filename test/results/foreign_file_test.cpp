// Run files that somebody else has made or changed: links, tables in other files, sizes that are only declared.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <functional>

#include "results/hdf5.hpp"
#include "results/run_reader.hpp"
#include "test/results/recordings.hpp"
#include "test/results/synthetic_run.hpp"

namespace kphi::results::foreign_file_test {

using namespace test;
using testing::HasSubstr;

class ForeignFile : public ::testing::Test {
 protected:
  ForeignFile() {
    write_run(path_, make_run({}));
    make_writable(path_);
  }
  /// What reading says once `change` was made with HDF5 itself.
  std::string read_after(const std::function<void(hid_t file)>& change) {
    hdf5::be_quiet();
    const hid_t file = H5Fopen(path_.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    EXPECT_GE(file, 0);
    change(file);
    H5Fclose(file);
    const std::string told = error_of<RecordError>([&] { (void)read_run(path_); });
    EXPECT_FALSE(verify_run(path_).whole());
    return told;
  }
  /// The table of this name again, of int64, as `list` and these rows have it.
  static void declare(hid_t file, const char* name, hsize_t rows, hid_t list) {
    H5Ldelete(file, name, H5P_DEFAULT);
    const hsize_t most = H5S_UNLIMITED;
    const hid_t space = H5Screate_simple(1, &rows, H5Pget_layout(list) == H5D_CHUNKED ? &most : nullptr);
    const hid_t set = H5Dcreate2(file, name, H5T_STD_I64LE, space, H5P_DEFAULT, list, H5P_DEFAULT);
    EXPECT_GE(set, 0);
    H5Dclose(set);
    H5Sclose(space);
  }
  TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_ / "a.h5";
};

constexpr const char* kTable = "load_cell/t_arrival_ns";

TEST_F(ForeignFile, HoldsNoLinkToAPipeThatNeverAnswers) {
  const std::string pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT(read_after([&](hid_t file) {
                H5Ldelete(file, "load_cell", H5P_DEFAULT);
                H5Lcreate_external(pipe.c_str(), "/", file, "load_cell", H5P_DEFAULT, H5P_DEFAULT);
              }),
              HasSubstr("a link that leads elsewhere"));
}

TEST_F(ForeignFile, HoldsNoSoftLinkThatStandsForAnotherTable) {
  EXPECT_THAT(read_after([](hid_t file) {
                H5Ldelete(file, kTable, H5P_DEFAULT);
                H5Lcreate_soft("/load_cell/ft_sequence", file, kTable, H5P_DEFAULT, H5P_DEFAULT);
              }),
              HasSubstr("a link that leads elsewhere"));
}

TEST_F(ForeignFile, HoldsNoTableWhoseRowsAreAnyOtherFile) {
  EXPECT_THAT(read_after([](hid_t file) {
                const hid_t list = H5Pcreate(H5P_DATASET_CREATE);
                H5Pset_external(list, "/etc/passwd", 0, 800);
                declare(file, kTable, 100, list);
                H5Pclose(list);
              }),
              HasSubstr("its rows lie in another file"));
}

TEST_F(ForeignFile, DeclaresNoMoreRowsThanItHolds) {
  for (const hsize_t rows : {hsize_t{100'000'000}, hsize_t{1} << 60}) {
    EXPECT_THAT(read_after([rows](hid_t file) {
                  const hid_t list = H5Pcreate(H5P_DATASET_CREATE);
                  const hsize_t chunk = 4096;
                  H5Pset_chunk(list, 1, &chunk);
                  declare(file, kTable, rows, list);
                  H5Pclose(list);
                }),
                HasSubstr("rows are declared, 0 bytes of them are in the file"));
  }
}

}  // namespace kphi::results::foreign_file_test
