// For the sources of the library, none of its headers: NaN is their business, and a compiler told that there is none
// leaves out what looks for it.
#pragma once

#if (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0) || defined(_M_FP_FAST)
#error \
    "compile the sources of the compensation library without -ffast-math: add -fno-fast-math -fno-finite-math-only for them (its CMakeLists.txt does); code that includes its headers may have it"
#endif
