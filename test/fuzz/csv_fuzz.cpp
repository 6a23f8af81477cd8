// libFuzzer: whatever the bytes are, the table readers and the judges of what they read refuse with a
// ConfigurationError or FitError or accept, and never crash. The first byte picks the dialect of a table of any make.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/error.hpp"
#include "fit/logs/import_table.hpp"
#include "fit/logs/stand_log.hpp"
#include "results/steps_csv.hpp"

namespace {

template <class Read>
void accept_or_refuse(Read read) {
  try {
    (void)read();
  } catch (const kphi::ConfigurationError&) {
  } catch (const kphi::FitError&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kphi::fit;
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data + 1), size - 1);
  const CsvDialect dialect{data[0] % 4 == 0 ? ';' : data[0] % 4 == 1 ? '\t' : '\0', data[0] % 8 >= 4};
  accept_or_refuse([&] { return audit(read_rcbenchmark(text, "log.csv"), {}); });
  accept_or_refuse([&] { return import_table(text, "apc_5x4_static.txt", {}); });
  accept_or_refuse([&] {
    ImportOptions options;
    options.columns = {
        {kThrust, "T", "N"}, {&StandRow::optical_rpm, "n", "RPM"}, {&StandRow::electrical_rpm, "e", "RPM"}};
    options.dialect = dialect;
    return import_table(text, "own.csv", options);
  });
  accept_or_refuse([&] { return parse_column_role(text); });
  accept_or_refuse([&] { return read_k_table(text, "K.csv", "N/RPM^2"); });
  accept_or_refuse([&] { return kphi::results::parse_steps(text, "steps.csv"); });
  return 0;
}
