# Raw run to step means: a library of its own, so that replay needs no device.
add_library(kphi_reduction STATIC
  clock_map.cpp
  event_doubts.cpp
  reduction.cpp
  repetitions.cpp
  supply_means.cpp
)
target_link_libraries(kphi_reduction PUBLIC kphi_options kphi_results PRIVATE kphi_profiles kphi_iq fmt::fmt)
