kphi_test(kphi_reduction_test
  SOURCES
    clock_map_test.cpp
    event_doubts_test.cpp
    reduction_test.cpp
    replay_commands_test.cpp
  LIBRARIES kphi_commands)
