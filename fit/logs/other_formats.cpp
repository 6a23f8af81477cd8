#include "fit/logs/other_formats.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"
#include "fit/logs/layout.hpp"
#include "fit/logs/table_shape.hpp"

namespace kphi::fit {
namespace {

struct Magic {
  std::string_view bytes;
  const char* what;
};

constexpr Magic kMagics[]{
    {"PK\x03\x04",
     "an Excel workbook or another zip archive; save its sheet as CSV, or `libreoffice --headless "
     "--convert-to csv FILE`, and import that"},
    {"\xD0\xCF\x11\xE0",
     "an old Excel workbook; save its sheet as CSV, or `libreoffice --headless --convert-to csv "
     "FILE`, and import that"},
    {"\x1F\x8B", "compressed by gzip; `gunzip -k FILE` and import what it gives"},
    {"BZh", "compressed by bzip2; `bunzip2 -k FILE` and import what it gives"},
    {"\xFD"
     "7zXZ",
     "compressed by xz; `unxz -k FILE` and import what it gives"},
    {"\x28\xB5\x2F\xFD", "compressed by zstd; `unzstd FILE` and import what it gives"},
    {"ULog\x01\x12\x35", "a flight log of PX4 (ULog); use `kphi fit FLIGHT --vehicle VEHICLE`"},
    {"\xBC\x01", "a flight log of a Crazyflie (card log); use `kphi fit FLIGHT --vehicle VEHICLE`"},
    {"\xBC\x02", "a flight log of a Crazyflie (card log); use `kphi fit FLIGHT --vehicle VEHICLE`"},
    {"\x89HDF\r\n",
     "an HDF5 file; a run of kphi is read by `kphi info`, a table in another one is exported with "
     "h5dump or h5py as CSV"},
    {"PAR1", "a Parquet file; write it as CSV (pandas: read_parquet, to_csv) and import that"},
    {"MATLAB 5.0", "a MATLAB file; write its table as CSV (writetable) and import that"},
    {"SQLite format 3", "an SQLite database; write its table as CSV (sqlite3 -csv) and import that"},
    {"%PDF", "a PDF; export the table from the program that made it as CSV"},
    {"H Product:Blackbox",
     "a flight log of Betaflight (blackbox); decode it with `blackbox_decode`, then use `kphi fit FLIGHT.csv --layout "
     "LAYOUT --vehicle VEHICLE`"}};

}  // namespace

void refuse_other_formats(std::string_view begin, const std::string& path) {
  for (const Magic& magic : kMagics)
    if (begin.starts_with(magic.bytes)) throw ConfigurationError(fmt::format("{}: {}", path, magic.what));
  const std::size_t nul = begin.find('\0');
  if (nul == std::string_view::npos || encoding_of(begin) == Encoding::utf16le ||
      encoding_of(begin) == Encoding::utf16be)
    return;
  refuse_at(path, 1 + static_cast<std::size_t>(std::ranges::count(begin.substr(0, nul), '\n')),
            fmt::format("a NUL byte, byte {} of the file: not a table of text", nul + 1));
}

}  // namespace kphi::fit
