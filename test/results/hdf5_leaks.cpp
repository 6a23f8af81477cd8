// HDF5 1.10 loses some bytes of its own when it refuses a damaged file; LeakSanitizer is told to look past it,
// shared or linked in.
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5\nleak:H5"; }
