#include "compensation/priorities.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/strict_math.hpp"

namespace kphi::compensation {
namespace {

constexpr bool kDouble = sizeof(Real) == sizeof(double);
/// Entries of the dictionary, and sines of angles between rotors, below which nothing is gained: two rotors so close to
/// parallel count as parallel. In double, too, for hubs that were told in float.
constexpr Real kFlat = Real(1e-5);
/// Entries that are rounding.
constexpr Real kZero = kDouble ? Real(1e-10) : Real(1e-5);
/// Changes of thrust that are, as a share of the largest.
constexpr Real kRounding = kDouble ? Real(1e-13) : Real(1e-6);
constexpr Real kFree = Real(1e30);
/// Steps on the spot after which the order of the variables decides (Bland's rule): so it cannot go round in a circle.
constexpr int kPatience = 3;
constexpr int kEasings = 4;
constexpr Real kEased = kDouble ? Real(1e-9) : Real(3e-5);

Real nearest(Real value, Range range) noexcept { return std::min(std::max(value, range.low), range.high); }

}  // namespace

WithinLimits::WithinLimits(Limits& limits, const Row& start, const Row& x, const Row& y, Sizes sizes) noexcept
    : limits_(limits), rotors_(start.size()), columns_count_(start.size()), sizes_(sizes) {
  Real largest = 0;
  for (std::size_t g = kMostRotors; g < kVariables; ++g) {
    low_[g] = -kFree;
    high_[g] = kFree;
    variables_[g - kMostRotors] = static_cast<std::uint8_t>(g);
  }
  for (std::size_t i = 0; i < columns_count_; ++i) {
    low_[i] = limits.low[i];
    high_[i] = limits.high[i];
    largest = std::max(largest, high_[i]);
    entries_[0][i] = y[i] / sizes.reach;
    entries_[1][i] = -x[i] / sizes.reach;
    entries_[2][i] = 1;
    variables_[kGoals + i] = static_cast<std::uint8_t>(i);
    move(i, nearest(start[i], {low_[i], high_[i]}));
  }
  nothing_ = kRounding * largest;
}

bool WithinLimits::cut_to_polygon(Real (&point)[2]) noexcept {
  // Its middle is that of the limits; from there it is as wide on either side. Edge i is along what rotor i makes.
  const Real *gx = entries_[0], *gy = entries_[1];
  Real wide[kMostRotors], spans[kMostRotors] = {}, x = point[0], y = point[1];
  for (std::size_t i = 0; i < rotors_; ++i) {
    const Real middle = (low_[i] + high_[i]) / 2;
    wide[i] = (high_[i] - low_[i]) / 2;
    x -= middle * gx[i];
    y -= middle * gy[i];
    for (std::size_t j = 0; j < i; ++j) {
      const Real across = std::fabs(gx[i] * gy[j] - gy[i] * gx[j]);
      spans[i] += across * wide[j];
      spans[j] += across * wide[i];
    }
  }
  Real square = kFree, nx = 0, ny = 0, to_x = 0, to_y = 0;
  for (std::size_t i = 0; i < rotors_; ++i) {
    const Real off = y * gx[i] - x * gy[i], beyond = std::fabs(off) - spans[i];
    if (!(beyond > 0)) continue;
    const Real length = std::sqrt(gx[i] * gx[i] + gy[i] * gy[i]), out = beyond / length;
    if (!(out > nothing_) || !(length > kFlat)) continue;
    const Real ex = gx[i] / length, ey = gy[i] / length, side = off < 0 ? Real(-1) : Real(1);
    Real middle = 0, half = 0;  // of the edge, along it
    for (std::size_t j = 0; j < rotors_; ++j) {
      const Real across = (gy[j] * ex - gx[j] * ey) * side, along = (gx[j] * ex + gy[j] * ey) * wide[j];
      if (std::fabs(across) > kFlat) {
        middle += across > 0 ? along : -along;
      } else {
        half += std::fabs(along);
      }
    }
    const Real here = x * ex + y * ey, beside = here - nearest(here, {middle - half, middle + half});
    // The foot of the perpendicular on the edge: nothing is nearer, whatever rounding makes of the distances.
    const bool foot = !(std::fabs(beside) > 0);
    if (!foot && !(out * out + beside * beside < square)) continue;
    square = out * out + beside * beside;
    nx = -ey * side;
    ny = ex * side;
    to_x = point[0] - out * nx - beside * ex;
    to_y = point[1] - out * ny - beside * ey;
    if (foot) break;
  }
  if (!(square < kFree)) return true;
  point[0] = to_x;
  point[1] = to_y;
  for (std::size_t i = 0; i < rotors_; ++i) {
    const Real across = gx[i] * nx + gy[i] * ny;
    if (!(std::fabs(across) > kFlat)) continue;
    const Real limit = across > 0 ? high_[i] : low_[i];
    move(i, limit - values_[i]);
    values_[i] = limit;
    fix(i);
  }
  return std::fabs(nx) <= std::fabs(ny);
}

void WithinLimits::reach_roll_pitch(Real roll, Real pitch) noexcept {
  Real point[2] = {roll / sizes_.reach, pitch / sizes_.reach};
  // On an edge first that of the two which changes along it.
  const std::size_t first = cut_to_polygon(point) ? 0 : 1;
  approach(kMostRotors + first, {point[first], point[first]});
  approach(kMostRotors + 1 - first, {point[1 - first], point[1 - first]});
  for (std::size_t i = 0; i < rotors_; ++i) {
    limits_.low[i] = low_[i];
    limits_.high[i] = high_[i];
  }
  forget_fixed();
}

void WithinLimits::forget_fixed() noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < rows_count_; ++i) {
    if (variables_[i] == index(Goal::roll) || variables_[i] == index(Goal::pitch)) continue;
    for (std::size_t j = 0; j < columns_count_; ++j) entries_[count][j] = entries_[i][j];
    variables_[count++] = variables_[i];
  }
  rows_count_ = count;
  count = 0;
  for (std::size_t j = 0; j < columns_count_; ++j) {
    if (fixed(variables_[kGoals + j])) continue;
    for (std::size_t i = 0; i < rows_count_; ++i) entries_[i][count] = entries_[i][j];
    variables_[kGoals + count++] = variables_[kGoals + j];
  }
  columns_count_ = count;
  if (sizes_.yaw_arm > 0) variables_[rows_count_++] = static_cast<std::uint8_t>(index(Goal::yaw));
}

void WithinLimits::set_yaw(const Row& arms, Real now) noexcept {
  constexpr std::size_t yaw = index(Goal::yaw), thrust = index(Goal::thrust);
  for (std::size_t i = 0; i < rotors_; ++i) {
    low_[i] = limits_.low[i];
    high_[i] = limits_.high[i];
  }
  low_[thrust] = low_[yaw] = -kFree;
  high_[thrust] = high_[yaw] = kFree;
  const std::size_t row = row_of(yaw);
  if (row == kGoals) return;
  const Real unit = 1 / sizes_.yaw_arm;
  for (std::size_t j = 0; j < columns_count_; ++j) {
    const std::size_t variable = variables_[kGoals + j];
    Real entry = variable < kMostRotors ? arms[variable] : Real(0);
    for (std::size_t i = 0; i < rows_count_; ++i) {
      if (variables_[i] < kMostRotors) entry += arms[variables_[i]] * entries_[i][j];
    }
    entries_[row][j] = entry * unit;
  }
  values_[yaw] = now * unit;
}

bool WithinLimits::correct_yaw(Real off) noexcept {
  constexpr std::size_t yaw = index(Goal::yaw);
  for (std::size_t j = 0; j < columns_count_; ++j) {
    if (variables_[kGoals + j] != yaw || !(std::fabs(off) > nothing_ * sizes_.yaw_arm)) continue;
    Real by = off / sizes_.yaw_arm;
    (void)blocking(j, by, kGoals, false);
    const Real told = values_[yaw];
    move(j, by);
    values_[yaw] = told;
    return true;
  }
  return false;
}

void WithinLimits::reach(Goal goal, Range wanted) noexcept {
  const Real unit = goal == Goal::yaw ? 1 / sizes_.yaw_arm : Real(1);
  approach(index(goal), {wanted.low * unit, wanted.high * unit});
}

void WithinLimits::approach(std::size_t goal, Range wanted) noexcept {
  const std::size_t row = row_of(goal);
  if (row == kGoals) return;
  low_[goal] = -kFree;
  high_[goal] = kFree;
  int on_the_spot = 0;
  for (int step = 0; step < kMostSteps; ++step) {
    const Real need = nearest(values_[goal], wanted) - values_[goal];
    if (!(std::fabs(need) > nothing_)) {
      if (!(wanted.low < wanted.high)) {
        fix(goal);
        (void)exchange(row);
        return;
      }
      low_[goal] = wanted.low;
      high_[goal] = wanted.high;
      return;
    }
    const bool careful = on_the_spot >= kPatience;
    const std::size_t column = entering(row, need, careful);
    if (column == columns_count_) {  // No nearer; what would take it away stays.
      for (std::size_t j = 0; j < columns_count_; ++j) {
        if (std::fabs(entries_[row][j]) > kFlat) fix(variables_[kGoals + j]);
      }
      return;
    }
    ++steps_;
    const std::size_t variable = variables_[kGoals + column];
    const Real whole = need / entries_[row][column];
    const Real own = room(variable, whole > 0), most = std::min(own, std::fabs(whole));
    Real by = whole > 0 ? most : -most;
    const std::size_t first = blocking(column, by, row, careful);
    on_the_spot = std::fabs(by) > nothing_ ? 0 : on_the_spot + 1;
    move(column, by);
    if (first < kGoals) {
      const std::size_t met = variables_[first];
      put_at_limit(met, entries_[first][column] * whole > 0);
      pivot(first, column);
    } else if (own < std::fabs(whole)) {
      put_at_limit(variable, whole > 0);
    } else {
      values_[goal] = need > 0 ? wanted.low : wanted.high;
      low_[goal] = wanted.low;
      high_[goal] = wanted.high;
      return pivot(row, column);
    }
  }
  cut_short_ = true;
  fix(goal);
}

std::size_t WithinLimits::entering(std::size_t row, Real need, bool careful) const noexcept {
  std::size_t best = columns_count_, first = kVariables;
  Real most = kFlat;
  const Real sign = need > 0 ? Real(1) : Real(-1);
  for (std::size_t j = 0; j < columns_count_; ++j) {
    const Real entry = entries_[row][j] * sign;
    if (!(std::fabs(entry) > most)) continue;
    const std::size_t variable = variables_[kGoals + j];
    if (!(room(variable, entry > 0) > nothing_) || (careful && variable > first)) continue;
    best = j;
    if (careful) {
      first = variable;
    } else {
      most = std::fabs(entry);
    }
  }
  return best;
}

Real WithinLimits::distance(std::size_t variable, Real change) const noexcept {
  const Real size = std::fabs(change);
  return size > kZero ? std::max(room(variable, change > 0), Real(0)) / size : kFree;
}

std::size_t WithinLimits::blocking(std::size_t column, Real& by, std::size_t but, bool careful) const noexcept {
  const Real sign = by > 0 ? Real(1) : Real(-1);
  std::size_t first = kGoals;
  Real most = by * sign, steepest = 0, tie = 0;
  for (std::size_t i = 0; i < rows_count_; ++i) {
    const Real entry = entries_[i][column] * sign, share = distance(variables_[i], entry), size = std::fabs(entry);
    // Of those that meet their limits together the one that bends the rest the least.
    const bool better = first < kGoals && (careful ? variables_[i] < variables_[first] : size > steepest);
    if (i == but || !(share < most - tie || (better && share <= most + tie))) continue;
    most = std::min(most, share);
    steepest = size;
    tie = nothing_;
    first = i;
  }
  by = most * sign;
  return first;
}

void WithinLimits::move(std::size_t column, Real by) noexcept {
  values_[variables_[kGoals + column]] += by;
  for (std::size_t i = 0; i < rows_count_; ++i) values_[variables_[i]] += entries_[i][column] * by;
}

void WithinLimits::pivot(std::size_t row, std::size_t column) noexcept {
  const Real inverse = 1 / entries_[row][column];
  for (std::size_t j = 0; j < columns_count_; ++j) entries_[row][j] *= -inverse;
  entries_[row][column] = inverse;
  for (std::size_t i = 0; i < rows_count_; ++i) {
    if (i == row) continue;
    const Real share = entries_[i][column];
    entries_[i][column] = 0;
    std::size_t j = columns_count_;
    do {
      --j;
      entries_[i][j] += share * entries_[row][j];
    } while (j != 0);
  }
  std::swap(variables_[row], variables_[kGoals + column]);
}

std::size_t WithinLimits::row_of(std::size_t goal) noexcept {
  for (std::size_t i = 0; i < rows_count_; ++i) {
    if (variables_[i] == goal) return i;
  }
  if (fixed(goal)) return kGoals;
  std::size_t column = 0, best = kGoals;
  while (variables_[kGoals + column] != goal) ++column;
  Real most = kFlat;
  for (std::size_t i = 0; i < rows_count_; ++i) {
    const Real size = std::fabs(entries_[i][column]);
    if (variables_[i] >= kMostRotors || !(size > most)) continue;
    most = size;
    best = i;
  }
  if (best < kGoals) pivot(best, column);
  return best;
}

bool WithinLimits::exchange(std::size_t row) noexcept {
  std::size_t best = columns_count_;
  Real most = kFlat;
  for (std::size_t j = 0; j < columns_count_; ++j) {
    const std::size_t variable = variables_[kGoals + j];
    if (fixed(variable)) continue;
    const bool between = room(variable, true) > nothing_ && room(variable, false) > nothing_;
    const Real worth = std::fabs(entries_[row][j]) * (between ? 1 : Real(0.1));
    if (!(worth > most)) continue;
    most = worth;
    best = j;
  }
  if (best == columns_count_) return false;
  pivot(row, best);
  return true;
}

void WithinLimits::ease() noexcept {
  // Conjugate gradients over the columns that may move, anew from each limit that is met.
  const Real eased = nothing_ * (kEased / kRounding);
  Real way[kVariables] = {}, before = 0;  // of the rows and, from kGoals on, the columns
  for (int step = 0; step < kEasings; ++step) {
    Real slopes[kMostRotors], square = 0;
    for (std::size_t j = 0; j < columns_count_; ++j) {
      const std::size_t variable = variables_[kGoals + j];
      slopes[j] = 0;
      if (variable >= kMostRotors || fixed(variable)) continue;
      Real slope = values_[variable];
      for (std::size_t i = 0; i < rows_count_; ++i) {
        if (variables_[i] < kMostRotors) slope += entries_[i][j] * values_[variables_[i]];
      }
      if (!(room(variable, slope < 0) > nothing_)) continue;
      slopes[j] = slope;
      square += slope * slope;
    }
    if (!(square > eased * eased)) return;
    ++steps_;
    const Real share = before > 0 ? square / before : Real(0);
    // Down the way to its lowest point, or to the first limit.
    Real down = 0, bend = 0;
    for (std::size_t i = 0; i < rows_count_; ++i) way[i] = 0;
    for (std::size_t j = 0; j < columns_count_; ++j) {
      const Real here = way[kGoals + j] = share * way[kGoals + j] - slopes[j];
      if (!(std::fabs(here) > 0)) continue;
      down -= slopes[j] * here;
      bend += here * here;
      for (std::size_t i = 0; i < rows_count_; ++i) way[i] += entries_[i][j] * here;
    }
    for (std::size_t i = 0; i < rows_count_; ++i) {
      if (variables_[i] < kMostRotors) bend += way[i] * way[i];
    }
    const Real whole = down / bend;
    Real by = whole;
    std::size_t first = kVariables;
    for (std::size_t k = kGoals + columns_count_; k-- > 0;) {
      const Real most = distance(variables_[k], way[k]);
      if (!(most < by)) continue;
      by = most;
      first = k;
    }
    for (std::size_t k = 0; k < kGoals + columns_count_; ++k) values_[variables_[k]] += by * way[k];
    before = first < kVariables ? Real(0) : square;
    if (first >= kGoals) continue;
    put_at_limit(variables_[first], way[first] > 0);
    if (!exchange(first)) return;
  }
  cut_short_ = true;
}

void WithinLimits::thrusts(Row& result) const noexcept {
  for (std::size_t i = 0; i < rotors_; ++i) result[i] = nearest(values_[i], {limits_.low[i], limits_.high[i]});
}

}  // namespace kphi::compensation
