#include "drivers/netbox/wire/rdt.hpp"

#include <boost/endian/conversion.hpp>

namespace kphi::netbox {

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
  const std::size_t count = records_in(datagram.size());
  for (std::size_t i = 0; i < count; ++i) decode(datagram.data() + i * kRecordBytes, out[i]);
  return count;
}

}  // namespace kphi::netbox
