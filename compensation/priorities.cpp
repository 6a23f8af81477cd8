#include "compensation/priorities.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace kphi::compensation {
namespace {

/// Squares of lengths below this share are rounding.
constexpr Real kNothing = sizeof(Real) == sizeof(double) ? Real(1e-20) : Real(1e-10);
/// And lengths.
constexpr Real kRounding = sizeof(Real) == sizeof(double) ? Real(1e-13) : Real(1e-6);

void add(Row& to, Real factor, const Row& row) noexcept {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += factor * row[i];
}

/// How large a·f can become.
Real size_of(const Row& row, const Row& high) noexcept {
  Real sum = 0;
  for (std::size_t i = 0; i < row.size(); ++i) sum += std::fabs(row[i]) * high[i];
  return sum;
}

}  // namespace

WithinLimits::WithinLimits(const Limits& limits, const Row& start) noexcept
    : low_(limits.low), high_(limits.high), thrusts_(start) {
  for (std::size_t i = 0; i < start.size(); ++i) {
    free_[i] = start[i] > low_[i] && start[i] < high_[i];
    if (!free_[i]) thrusts_[i] = start[i] > low_[i] ? high_[i] : low_[i];
  }
}

Real WithinLimits::free_dot(const Row& a, const Row& b) const noexcept {
  Real sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += free_[i] ? a[i] * b[i] : Real(0);
  return sum;
}

Row WithinLimits::reduced(Row row, const Basis& basis) const noexcept {
  for (int pass = 0; pass < 2; ++pass) {  // one leaves what rounding let through
    for (std::size_t k = 0; k < basis.size; ++k) add(row, -free_dot(row, basis.rows[k]), basis.rows[k]);
  }
  return row;
}

WithinLimits::Basis WithinLimits::basis() const noexcept {
  Basis basis;
  const auto take = [&](const Row& row) {
    Row rest = reduced(row, basis);
    const Real square = free_dot(rest, rest);
    if (!(square > kNothing * dot(row, row))) return false;
    const Real scale = 1 / std::sqrt(square);
    for (Real& value : rest) value *= scale;
    basis.rows[basis.size++] = rest;
    return true;
  };
  for (std::size_t k = 0; k < kept_count_; ++k) take(kept_[k]);
  if (bounded_counts_ && at_bound_ != 0) basis.ends_with_bounded = take(bounded_);
  return basis;
}

Real WithinLimits::missing(const Row& row, Range wanted) const noexcept {
  const Real now = dot(row, thrusts_);
  return std::min(std::max(now, wanted.low), wanted.high) - now;
}

void WithinLimits::go(const Row& way, Real share) noexcept {
  std::size_t first = way.size();
  for (std::size_t i = 0; i < way.size(); ++i) {
    if (!free_[i] || !(std::fabs(way[i]) > 0)) continue;
    const Real room = ((way[i] > 0 ? high_[i] : low_[i]) - thrusts_[i]) / way[i];
    if (room < share) {
      share = std::max(room, Real(0));
      first = i;
    }
  }
  if (bounded_counts_ && at_bound_ == 0) {
    const Real slope = free_dot(bounded_, way), now = dot(bounded_, thrusts_);
    const Real room = std::fabs(slope) > 0 ? ((slope > 0 ? bounds_.high : bounds_.low) - now) / slope
                                           : std::numeric_limits<Real>::infinity();
    if (room < share) {
      share = std::max(room, Real(0));
      first = way.size();
      at_bound_ = slope > 0 ? 1 : -1;
    }
  }
  for (std::size_t i = 0; i < way.size(); ++i) {
    if (free_[i]) thrusts_[i] = std::min(std::max(thrusts_[i] + share * way[i], low_[i]), high_[i]);
  }
  if (first == way.size()) return;
  thrusts_[first] = way[first] > 0 ? high_[first] : low_[first];
  free_[first] = false;
}

bool WithinLimits::let_go(const Row& gain, const Row& wish, const Basis& basis, Real least) noexcept {
  std::size_t best = gain.size();
  Real most = least;
  for (std::size_t i = 0; i < gain.size(); ++i) {
    if (free_[i] || !(low_[i] < high_[i])) continue;
    const Real inwards = thrusts_[i] > low_[i] ? -gain[i] : gain[i];
    if (inwards > most) {
      most = inwards;
      best = i;
    }
  }
  if (best < gain.size()) {
    free_[best] = true;
    return true;
  }
  if (!basis.ends_with_bounded || !(bounds_.low < bounds_.high)) return false;
  const Real inwards = -static_cast<Real>(at_bound_) * free_dot(wish, basis.rows[basis.size - 1]);
  if (!(inwards > least)) return false;
  at_bound_ = 0;
  return true;
}

void WithinLimits::go_towards(const Row& a, const Row& b, Range wanted_a, Real wanted_b) noexcept {
  const Real size = dot(a, a) + dot(b, b), rounding = kRounding * (size_of(a, high_) + size_of(b, high_));
  for (int step = 0; step < most_steps(a.size()); ++step) {
    const Real left_a = missing(a, wanted_a), left_b = missing(b, {wanted_b, wanted_b});
    const Real left = std::sqrt(left_a * left_a + left_b * left_b);
    if (!(left > rounding)) return;
    ++steps_;
    const Basis held = basis();
    Row wish(a.size());
    add(wish, left_a / left, a);
    add(wish, left_b / left, b);
    const Row down = reduced(wish, held);
    const Real slope = free_dot(down, down);
    if (!(slope > kNothing * size)) {
      if (!let_go(down, wish, held, kRounding * std::sqrt(size))) return;
      continue;
    }
    // The best point of all that is free: two unknowns, along what a and b leave.
    Row first = reduced(a, held), second = reduced(b, held);
    Real left_first = left_a, left_second = left_b;
    if (free_dot(first, first) < free_dot(second, second)) {
      std::swap(first, second);
      std::swap(left_first, left_second);
    }
    const Real square = free_dot(first, first), along = free_dot(first, second) / square;
    add(second, -along, first);
    add(second, -free_dot(first, second) / square, first);
    const Real across = free_dot(second, second);
    Row way(a.size());
    if (across > kNothing * square) {
      add(way, left_first / square, first);
      add(way, (left_second - along * left_first) / across, second);
    } else {  // a and b leave one direction: down it to the lowest point
      const Real gain_a = free_dot(a, down), gain_b = free_dot(b, down);
      add(way, left * slope / (gain_a * gain_a + gain_b * gain_b), down);
    }
    go(reduced(way, held), 1);
  }
}

void WithinLimits::reach(const Row& row, Range wanted, Keep keep) noexcept {
  bounded_counts_ = bounded_counts_ && keep != Keep::within;
  go_towards(row, Row(row.size()), wanted, 0);
  if (keep == Keep::as_it_is) {
    kept_[kept_count_++] = row;
    return;
  }
  const Real now = dot(row, thrusts_), rounding = kRounding * size_of(row, high_);
  bounded_ = row;
  bounded_counts_ = true;
  bounds_ = std::fabs(missing(row, wanted)) > rounding ? Range{now, now} : wanted;
  at_bound_ = now >= bounds_.high - rounding ? 1 : now <= bounds_.low + rounding ? -1 : 0;
}

void WithinLimits::reach(const Row& a, const Row& b, Real wanted_a, Real wanted_b) noexcept {
  go_towards(a, b, {wanted_a, wanted_a}, wanted_b);
  kept_[kept_count_++] = a;
  kept_[kept_count_++] = b;
}

}  // namespace kphi::compensation
