kphi_test(kphi_reduction_test
  SOURCES
    cell_stream_test.cpp
    clock_map_test.cpp
    event_doubts_test.cpp
    hysteresis_test.cpp
    lag_test.cpp
    mean_error_test.cpp
    motor_series_test.cpp
    real_logs_test.cpp
    reduction_doubts_test.cpp
    reduction_test.cpp
    reference_drift_test.cpp
    repetitions_test.cpp
    settling_test.cpp
    speed_cap_test.cpp
    step_study_test.cpp
    zeros_test.cpp
  LIBRARIES kphi_reduction)
kphi_test(kphi_replay_test SOURCES replay_commands_test.cpp LIBRARIES kphi_commands)
