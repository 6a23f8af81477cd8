// HDF5 keeps texts in global heaps, the only metadata of a run file without a checksum, and its library (1.10, 1.14)
// trusts what they say of themselves: one wrong byte there makes it read and write anywhere in memory.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <span>

namespace kphi::results::hdf5 {

/// A collection as run files have them: its objects fill it, are numbered from 1 without a gap, since each is written
/// once, and hold a text without a zero or a reference. Layout: HDF5 File Format Specification 3.0, III.E.
[[nodiscard]] bool is_sound_heap(std::span<const std::byte> collection) noexcept;

/// Access to files that refuses to read a heap that is not sound. A process opens a file twice only by the same access.
/// To be closed by the caller; negative: HDF5 refuses.
[[nodiscard]] hid_t checked_access();

}  // namespace kphi::results::hdf5
