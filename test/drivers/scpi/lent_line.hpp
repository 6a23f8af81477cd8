// A line that a test keeps, given to a supply that wants to own its line.
#pragma once

#include <memory>

#include "drivers/scpi/line.hpp"

namespace kphi::scpi {

class LentLine final : public Line {
 public:
  explicit LentLine(Line& line) : line_(line) {}
  void write(std::string_view command) override { line_.write(command); }
  std::string query(std::string_view command) override { return line_.query(command); }
  const std::string& name() const noexcept override { return line_.name(); }

 private:
  Line& line_;
};

inline std::unique_ptr<Line> lend(Line& line) { return std::make_unique<LentLine>(line); }

}  // namespace kphi::scpi
