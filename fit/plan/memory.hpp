// Noise that remembers: its correlation falls as exp(-t/τ) (a first-order autoregression, G. Box, G. Jenkins, Time
// series analysis, 3.2; science.md, eq. 29). What a mean over a window keeps of it, and how alike the means of
// neighbouring steps are.
#pragma once

namespace kphi::fit {

/// Longer than anything on a stand, s: such noise is an offset.
inline constexpr double kEndlessMemory = 1e4;

/// Variance of the mean over `window_s`, for unit intensity: 1/window where the memory is short, and 1/(2 τ) where it
/// is long. Only ratios of it mean something.
[[nodiscard]] double averaged(double window_s, double memory_s);

/// Correlation of the means over windows of neighbouring steps, whose begins are `apart_s` apart.
[[nodiscard]] double neighbours_correlation(double window_s, double apart_s, double memory_s);

/// The memory that makes neighbouring steps as alike as this, at least a quarter of the window: below, a step does not
/// know its neighbour whatever the memory is.
[[nodiscard]] double memory_of_neighbours(double correlation, double window_s, double apart_s);

}  // namespace kphi::fit
