kphi_test(kphi_reduction_test
  SOURCES
    ../../daq/replay_commands.cpp
    clock_map_test.cpp
    reduction_test.cpp
    replay_commands_test.cpp
  LIBRARIES kphi_reduction kphi_profiles CLI11::CLI11)
