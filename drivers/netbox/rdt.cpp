#include "drivers/netbox/rdt.hpp"

#include <boost/endian/conversion.hpp>

namespace kphi::netbox {

using boost::endian::load_big_s32;
using boost::endian::load_big_u32;
using boost::endian::store_big_u16;
using boost::endian::store_big_u32;

std::array<std::uint8_t, 8> encode_request(Command command, std::uint32_t sample_count) noexcept {
  std::array<std::uint8_t, 8> request{};
  store_big_u16(&request[0], 0x1234);
  store_big_u16(&request[2], static_cast<std::uint16_t>(command));
  store_big_u32(&request[4], sample_count);
  return request;
}

std::size_t decode(std::span<const std::uint8_t> datagram, std::span<Record, kMaxRecords> out) noexcept {
  const std::size_t count = datagram.size() / kRecordBytes;
  if (datagram.size() % kRecordBytes != 0 || count > kMaxRecords) return 0;
  const std::uint8_t* bytes = datagram.data();
  for (std::size_t i = 0; i < count; ++i, bytes += kRecordBytes) {
    Record& record = out[i];
    record.rdt_sequence = load_big_u32(bytes);
    record.ft_sequence = load_big_u32(bytes + 4);
    record.status = load_big_u32(bytes + 8);
    for (std::size_t axis = 0; axis < 6; ++axis) record.counts[axis] = load_big_s32(bytes + 12 + 4 * axis);
  }
  return count;
}

}  // namespace kphi::netbox
