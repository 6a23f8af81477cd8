// The marks in the numbers of a table: which one is before the decimals, which one groups the thousands. "3,000" is 3
// or 3000, and only the other numbers of the table can tell.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace kphi::fit {

struct NumberFormat {
  char decimal = '.';    ///< '.' or ','; '\0': no number of the table has a mark
  char grouping = '\0';  ///< '.', ',', ' ' (any blank), '\''; '\0': thousands are not grouped

  /// The whole field as a finite number, blanks around it allowed; thousands in groups of three or not at all.
  /// nullopt for anything else.
  [[nodiscard]] std::optional<double> parse(std::string_view field) const;
  /// Of 1234.5: "1.234,5", "1234.5"
  [[nodiscard]] std::string example() const;
  [[nodiscard]] bool operator==(const NumberFormat&) const = default;
};

/// Digits and marks that some format reads as a number.
[[nodiscard]] bool looks_like_number(std::string_view field);

/// Collects what the numbers of a table say about their marks.
class MarkEvidence {
 public:
  void add(std::string_view field, std::size_t line);

  /// Of the first field that shows it; line 0: none does.
  struct Witness {
    std::string field;
    std::size_t line = 0;
  };
  [[nodiscard]] const Witness& decimal(char mark) const { return decimal_[mark == ',' ? 1 : 0]; }
  /// "3,000", "1.080": with three digits behind a mark that nothing else tells the meaning of.
  [[nodiscard]] const Witness& either(char mark) const { return either_[mark == ',' ? 1 : 0]; }

  /// The one format that fits all evidence; a mark that nothing tells of is then still open (open_mark).
  /// nullopt: numbers of the table contradict each other.
  [[nodiscard]] std::optional<NumberFormat> format() const;
  /// With `decimal` before the decimals, whatever they say.
  [[nodiscard]] NumberFormat format_with(char decimal) const;
  /// The mark that may be before decimals or thousands; '\0': none.
  [[nodiscard]] char open_mark() const;

 private:
  [[nodiscard]] bool decimal_is(char mark) const;

  Witness decimal_[2], grouping_[2], either_[2];  ///< of '.' and ','
  Witness blank_, apostrophe_;                    ///< as grouping
};

}  // namespace kphi::fit
