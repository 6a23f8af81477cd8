// Prints K_T [N/RPM²] of a coefficient file, or why it is refused.
#include <cstdio>

#include "compensation/file/coefficient_file.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    const auto coefficients = kphi::compensation::load_coefficients(argv[1]);
    std::printf("%.4g\n", kphi::to_newtons_per_rpm2(coefficients.curve.thrust_coefficient()));
  } catch (const kphi::compensation::CoefficientError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
