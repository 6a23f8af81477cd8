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
  const LayoutHints hints{{{Role::thrust, "T", "N"}, {Role::speed, "n", "RPM"}, {Role::electrical_speed, "e", "RPM"}},
                          data[0] % 4 == 0   ? ';'
                          : data[0] % 4 == 1 ? '\t'
                                             : '\0',
                          data[0] % 8 >= 4 ? std::optional(',') : std::nullopt};
  accept_or_refuse([&] { return audit(read_log(text, "log.csv"), {}); });
  accept_or_refuse([&] { return import_table(text, "apc_5x4_static.txt", {}); });
  accept_or_refuse([&] {
    ImportOptions options;
    options.hints = hints;
    return import_groups(text, "own.csv", options);
  });
  accept_or_refuse([&] { return parse_column_role(text); });
  accept_or_refuse([&] { return parse_layout(std::string(text), "layout.yaml"); });
  accept_or_refuse([&] {
    for (const Import& import : import_groups(text, "own.csv", {})) (void)judged_fit(import.table);
    return 0;
  });
  accept_or_refuse([&] { return read_k_table(text, "K.csv", "N/RPM^2"); });
  accept_or_refuse([&] { return kphi::results::parse_steps(text, "steps.csv"); });
  return 0;
}
