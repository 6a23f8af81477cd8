// Uncertainty budget of one number by the GUM (JCGM 100:2008): what contributes, how that was evaluated, how much it
// weighs.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "fit/numerics/hypothesis_test.hpp"

namespace kphi::fit {

enum class Evaluation : std::uint8_t {
  type_a,  ///< from the scatter of what was measured here
  type_b,  ///< from anything else: data sheet, check weight, judgement
};

struct BudgetRow {
  std::string source;  ///< "repetitions", "motor clock", …
  Evaluation evaluation = Evaluation::type_a;
  double u = 0;            ///< standard uncertainty of the input, in `unit`; NaN: nobody knows, and the sum lacks it
  std::string unit;        ///< "N", "1" (relative), …
  double sensitivity = 0;  ///< change of the result per `unit`
  double freedom = std::numeric_limits<double>::infinity();
  bool common = false;  ///< the same error in every coefficient of the campaign: it cancels in ratios
  std::string note;     ///< where the number comes from; may be empty

  [[nodiscard]] bool known() const { return u == u; }
  [[nodiscard]] double contribution() const;  ///< |sensitivity| u, unit of the result; 0 when not known
};

struct Budget {
  std::string quantity;  ///< "K_T", "k(45 deg)", "slope", "k_i(90 deg)", …
  std::string unit;      ///< of the value
  double value = 0;
  std::vector<BudgetRow> rows;

  [[nodiscard]] double combined() const;                     ///< standard uncertainty (eq. 10; rows are independent)
  [[nodiscard]] double freedom() const;                      ///< Welch-Satterthwaite (G.2b)
  [[nodiscard]] double coverage(double level = 0.95) const;  ///< Student's factor for freedom()
  [[nodiscard]] double expanded(double level = 0.95) const;  ///< half the interval
  [[nodiscard]] double share(const BudgetRow& row) const;    ///< of the variance, 0..1
  [[nodiscard]] Estimate estimate() const { return {value, combined(), freedom()}; }
};

}  // namespace kphi::fit
