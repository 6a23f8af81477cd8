// libFuzzer: any bytes are a journal, whole or damaged; a state and a verdict follow from them without an exception.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "results/campaign_folder.hpp"
#include "results/journal.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kphi::results;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const JournalReading reading = parse_journal(text, "journal.jsonl");
  (void)state_of(reading);
  // The chain of checks stops nearly every input: the same line as an event whose check is right.
  (void)state_of(parse_journal(chained_line("", text), "journal.jsonl"));
  return 0;
}
