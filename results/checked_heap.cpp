#include "results/checked_heap.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <optional>
#include <vector>

namespace kphi::results::hdf5 {
namespace {

constexpr char kBegin[] = {'G', 'C', 'O', 'L', 1};
constexpr std::size_t kHeader = 16;      // of the collection, and of each object
constexpr std::size_t kReference = 8;    // to a dataset that is a scale of another
constexpr std::size_t kSmallest = 4096;  // HDF5 reads that much first, then the rest if there is more

template <class T>
T number_at(std::span<const std::byte> bytes, std::size_t place) noexcept {
  T number;
  std::memcpy(&number, bytes.data() + place, sizeof number);
  return number;
}

bool is_heap(std::span<const std::byte> bytes) noexcept {
  return bytes.size() >= kHeader && std::memcmp(bytes.data(), kBegin, sizeof kBegin) == 0;
}

/// HDF5's plain driver, and the one that checks. Made once.
struct Drivers {
  H5FD_class_t plain, checked;
  hid_t id;
};
std::optional<Drivers> drivers;

herr_t read(H5FD_t* file, H5FD_mem_t type, hid_t list, haddr_t place, std::size_t size, void* out) {
  const herr_t status = drivers->plain.read(file, type, list, place, size, out);
  const auto bytes = std::span(static_cast<const std::byte*>(out), size);
  if (status < 0 || !is_heap(bytes)) return status;                     // HDF5 refuses one that begins otherwise
  const bool is_beginning = number_at<std::uint64_t>(bytes, 8) > size;  // the whole follows
  if (is_beginning || is_sound_heap(bytes)) return status;
  H5Epush2(H5E_DEFAULT, __FILE__, __func__, __LINE__, H5E_ERR_CLS, H5E_HEAP, H5E_BADVALUE, "its texts are damaged");
  return -1;
}

/// Only an open file tells what its driver is made of.
std::optional<Drivers> make_drivers() {
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  H5FD_t* open = H5Pset_fapl_sec2(access) < 0 ? nullptr : H5FDopen("/dev/null", H5F_ACC_RDONLY, access, HADDR_UNDEF);
  H5Pclose(access);
  if (open == nullptr) return std::nullopt;
  Drivers made{*open->cls, *open->cls, H5I_INVALID_HID};
  H5FDclose(open);
  made.checked.name = "kphi";
  made.checked.read = &read;
  return made;
}

}  // namespace

bool is_sound_heap(std::span<const std::byte> collection) noexcept {
  if (collection.size() < kSmallest || !is_heap(collection)) return false;
  const auto size = number_at<std::uint64_t>(collection, 8);
  if (size < kSmallest || size > collection.size()) return false;
  const std::span<const std::byte> bytes = collection.first(size);
  for (std::size_t at = kHeader, expected = 1; at != size; ++expected) {
    const std::size_t left = size - at;
    if (left < kHeader) return true;  // too little for another object
    const auto index = number_at<std::uint16_t>(bytes, at);
    const auto length = number_at<std::uint64_t>(bytes, at + 8);
    if (index == 0) return length == left;  // what is free, its header included
    if (index != expected || length > left - kHeader) return false;
    const std::size_t taken = kHeader + (length + 7) / 8 * 8;
    if (taken > left) return false;
    const auto content = bytes.subspan(at + kHeader, length);
    if (length != kReference && std::ranges::find(content, std::byte{0}) != content.end()) return false;
    at += taken;
  }
  return true;
}

hid_t checked_access() {
  static std::mutex making;
  const std::lock_guard lock(making);
  if (!drivers) {
    drivers = make_drivers();
    if (!drivers) return H5I_INVALID_HID;
    drivers->id = H5FDregister(&drivers->checked);
  }
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  if (H5Pset_driver(access, drivers->id, nullptr) >= 0) return access;
  H5Pclose(access);
  return H5I_INVALID_HID;
}

}  // namespace kphi::results::hdf5
