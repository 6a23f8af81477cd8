// The look that all figures share.
#pragma once

#include <fmt/format.h>

#include <array>
#include <string>

namespace kphi::fit {

/// Okabe and Ito's colours: apart for every kind of colour vision. With them a shape, for prints in grey.
struct Mark {
  const char* colour;
  int shape;  ///< gnuplot's point type
};
inline constexpr std::array<Mark, 7> kMarks{{{"#0072B2", 7},
                                             {"#D55E00", 5},
                                             {"#009E73", 9},
                                             {"#CC79A7", 13},
                                             {"#E69F00", 11},
                                             {"#56B4E9", 15},
                                             {"#444444", 6}}};
[[nodiscard]] constexpr Mark mark(std::size_t i) { return kMarks[i % kMarks.size()]; }

[[nodiscard]] inline std::string figure_head(int height = 470) {
  return fmt::format(
      "set terminal svg size 800,{} noenhanced font 'Helvetica,Arial,sans-serif,14' linewidth 1.2 background "
      "'#ffffff'\n"
      "set encoding utf8\nset minussign\n"
      "set border 3 lc rgb '#777777'\n"
      "set tics nomirror out scale 0.6 textcolor rgb '#333333'\n"
      "set grid ytics lc rgb '#e4e4e4' lt 1 lw 0.8\n"
      "set key opaque fillcolor rgb '#ffffff' noenhanced\n",
      height);
}

/// A named block of inline data.
[[nodiscard]] inline std::string data_block(const std::string& name, const std::string& rows) {
  return fmt::format("${} << EOD\n{}EOD\n", name, rows);
}

}  // namespace kphi::fit
