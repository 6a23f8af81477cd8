// libFuzzer: whatever the bytes are, the table readers refuse with a ConfigurationError or accept, and never crash.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "fit/k_table.hpp"
#include "fit/rcbenchmark_csv.hpp"
#include "fit/uiuc_table.hpp"
#include "profiles/configuration_error.hpp"

namespace {

template <class Read>
void accept_or_refuse(Read read) {
  try {
    (void)read();
  } catch (const kphi::ConfigurationError&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kphi::fit;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  accept_or_refuse([&] { return select_rows(read_rcbenchmark(text, "log.csv")); });
  accept_or_refuse([&] { return read_uiuc(text, "apc_5x4_static.txt"); });
  accept_or_refuse([&] { return read_k_table(text, "K.csv"); });
  return 0;
}
