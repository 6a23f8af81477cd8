// The box's units in SI, by code (`cfgfu` and `cfgtu`, the TCP interface's forceUnits and torqueUnits) and by name.
#pragma once

namespace kphi::netbox {

struct Unit {
  const char* name;
  int code;
  double si;  ///< newtons or newton-metres in one
};

inline constexpr double kLbf = 4.4482216152605, kKgf = 9.80665;
inline constexpr Unit kForceUnits[] = {
    {"N", 2, 1.0},    {"kN", 4, 1000.0},      {"lbf", 1, kLbf}, {"klbf", 3, 1000.0 * kLbf},
    {"kgf", 5, kKgf}, {"gf", 6, 1e-3 * kKgf},
};
inline constexpr Unit kTorqueUnits[] = {{"Nm", 3, 1.0},
                                        {"N-m", 3, 1.0},
                                        {"Nmm", 4, 1e-3},
                                        {"N-mm", 4, 1e-3},
                                        {"kg-cm", 5, 1e-2 * kKgf},
                                        {"kgf-cm", 5, 1e-2 * kKgf},
                                        {"kNm", 6, 1000.0},
                                        {"kN-m", 6, 1000.0},
                                        {"lbf-in", 1, 0.1129848290276167},
                                        {"lbf-ft", 2, 1.3558179483314004}};

}  // namespace kphi::netbox
