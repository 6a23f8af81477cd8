#include "drivers/scpi/common_commands.hpp"

#include "drivers/scpi/numbers.hpp"

namespace kphi::scpi {
namespace {

constexpr int kLongestQueue = 64;  // of errors; real ones hold 10 to 32

}  // namespace

std::array<std::string, 4> identity_fields(const std::string& identity) {
  std::array<std::string, 4> fields;
  std::size_t from = 0;
  for (std::string& field : fields) {
    const std::size_t comma = identity.find(',', from);
    field = identity.substr(from, comma - from);
    if (comma == std::string::npos) break;
    from = comma + 1;
  }
  return fields;
}

std::string next_error(Line& line) {
  std::string error;
  for (int i = 0; i < kLongestQueue; ++i) {
    error = line.query("SYST:ERR?");
    const auto code = number_of(std::string_view(error).substr(0, error.find(',')));
    if (code && *code == 0) return {};
    if (!code || *code > -400 || *code < -499) break;
  }
  return error;
}

void forget_errors(Line& line) {
  for (int i = 0; i < kLongestQueue && !next_error(line).empty(); ++i) {
  }
}

}  // namespace kphi::scpi
