# Raw run to step means: a library of its own, so that replay needs no device.
add_library(kphi_reduction STATIC
  cell_bin.cpp
  cell_stream.cpp
  clock_map.cpp
  event_doubts.cpp
  hysteresis.cpp
  lag.cpp
  mean_error.cpp
  motor_series.cpp
  reduction.cpp
  reference_drift.cpp
  repetitions.cpp
  settling.cpp
  speed_cap.cpp
  step_doubts.cpp
  supply_means.cpp
  zeros.cpp
)
target_link_libraries(kphi_reduction PUBLIC kphi_options kphi_results kphi_iq PRIVATE kphi_profiles Boost::headers fmt::fmt)
# Loops over every sample, or over every bin again and again: worth their vectors.
set_source_files_properties(cell_bin.cpp cell_stream.cpp clock_map.cpp lag.cpp PROPERTIES COMPILE_OPTIONS "$<$<CONFIG:Release>:-O3>")
