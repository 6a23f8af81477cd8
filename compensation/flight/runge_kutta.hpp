// The classical fourth-order Runge-Kutta step with a fixed width.
#pragma once

namespace kphi::flight {

/// `slope(stage, y)` is dy/dt; `stage` 0, 1, 2 stands for the step's beginning, middle and end.
template <class State, class Slope>
[[nodiscard]] State runge_kutta_step(const State& y, double width, const Slope& slope) {
  const State first = slope(0, y);
  const State second = slope(1, State(y + width / 2 * first));
  const State third = slope(1, State(y + width / 2 * second));
  const State fourth = slope(2, State(y + width * third));
  return y + width / 6 * (first + 2 * second + 2 * third + fourth);
}

}  // namespace kphi::flight
