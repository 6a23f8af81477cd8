#include "test/compensation/float_side.hpp"

#include "test/compensation/flown.hpp"

#ifndef KPHI_FLOAT
#error "compiled with KPHI_FLOAT"
#endif

namespace kphi::test {

Flown flown_in_float(const Vehicle& vehicle) { return flown<Flown>(vehicle); }

}  // namespace kphi::test
