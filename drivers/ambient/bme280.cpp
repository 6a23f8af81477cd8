#include "drivers/ambient/bme280.hpp"

#include <algorithm>

namespace kphi::ambient::bme280 {
namespace {

// Wider than the data sheet's 32 and 64 bits: the results agree wherever those suffice, and no input overflows.
using Wide = std::int64_t;
__extension__ using Wider = __int128;  // for damaged calibrations

std::uint16_t u16(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8);
}
std::int16_t s16(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return static_cast<std::int16_t>(u16(bytes, at));
}
std::int16_t sign_extended_12(int value) noexcept {
  return static_cast<std::int16_t>(value >= 0x800 ? value - 0x1000 : value);
}

Wide fine_temperature(Wide adc, const Calibration& c) noexcept {
  const Wide first = (((adc >> 3) - (Wide{c.t1} * 2)) * c.t2) >> 11;
  const Wide offset = (adc >> 4) - c.t1;
  return first + ((((offset * offset) >> 12) * c.t3) >> 14);
}

std::uint32_t pressure(Wide adc, Wide t_fine, const Calibration& c) noexcept {
  const Wider v = t_fine - 128000;
  const Wider v2 = v * v * c.p6 + v * c.p5 * (Wider{1} << 17) + Wider{c.p4} * (Wider{1} << 35);
  const Wider v1 = (((Wider{1} << 47) + ((v * v * c.p3) >> 8) + v * c.p2 * 4096) * c.p1) >> 33;
  if (v1 == 0) return 0;
  Wider p = ((Wider{1048576 - adc} * (Wider{1} << 31) - v2) * 3125) / v1;
  const Wider square = (Wider{c.p9} * (p >> 13) * (p >> 13)) >> 25;
  p = ((p + square + ((Wider{c.p8} * p) >> 19)) >> 8) + Wider{c.p7} * 16;
  return p < 0 || p > Wider{0xFFFFFFFF} ? 0 : static_cast<std::uint32_t>(p);
}

std::uint32_t humidity(Wide adc, Wide t_fine, const Calibration& c) noexcept {
  const Wider v = t_fine - 76800;
  const Wider a = (Wider{adc} * 16384 - Wider{c.h4} * 1048576 - c.h5 * v + 16384) >> 15;
  const Wider damp = ((((v * c.h6) >> 10) * (((v * c.h3) >> 11) + 32768)) >> 10) + 2097152;
  const Wider x = a * ((damp * c.h2 + 8192) >> 14);
  const Wider bent = x - (((((x >> 15) * (x >> 15)) >> 7) * c.h1) >> 4);
  return static_cast<std::uint32_t>(std::clamp<Wider>(bent, 0, 419430400) >> 12);
}

}  // namespace

Calibration calibration_of(std::span<const std::uint8_t, 24> first, std::uint8_t h1,
                           std::span<const std::uint8_t, 7> second) noexcept {
  Calibration c;
  c.t1 = u16(first, 0), c.t2 = s16(first, 2), c.t3 = s16(first, 4);
  c.p1 = u16(first, 6);
  std::size_t at = 8;
  for (std::int16_t* p : {&c.p2, &c.p3, &c.p4, &c.p5, &c.p6, &c.p7, &c.p8, &c.p9}) {
    *p = s16(first, at);
    at += 2;
  }
  c.h1 = h1;
  c.h2 = s16(second, 0);
  c.h3 = second[2];
  c.h4 = sign_extended_12(second[3] << 4 | (second[4] & 0x0F));
  c.h5 = sign_extended_12(second[5] << 4 | second[4] >> 4);
  c.h6 = static_cast<std::int8_t>(second[6]);
  return c;
}

std::string_view refusal_of(const Calibration& c) noexcept {
  if (c.t1 == 0 || c.p1 == 0) return "T1 or P1 is zero";
  if (c.t1 == 0xFFFF && c.p1 == 0xFFFF && c.t2 == -1) return "every byte is ff: nothing drives the bus";
  if (c.t2 == 0) return "T2 is zero";
  return {};
}

Raw raw_of(std::span<const std::uint8_t, 8> d) noexcept {
  const auto twenty = [&](std::size_t at) {
    return static_cast<std::uint32_t>(d[at]) << 12 | static_cast<std::uint32_t>(d[at + 1]) << 4 | d[at + 2] >> 4;
  };
  return {twenty(0), twenty(3), static_cast<std::uint32_t>(d[6]) << 8 | d[7]};
}

bool complete(const Raw& raw) noexcept {
  return raw.pressure != 0x80000 && raw.temperature != 0x80000 && raw.humidity != 0x8000;
}

Measured compensate(const Raw& raw, const Calibration& calibration) noexcept {
  const Wide t_fine = fine_temperature(raw.temperature, calibration);
  Measured measured;
  measured.t_fine = static_cast<std::int32_t>(t_fine);
  measured.temperature_centi_c = static_cast<std::int32_t>((t_fine * 5 + 128) >> 8);
  measured.pressure_256th_pa = pressure(raw.pressure, t_fine, calibration);
  measured.humidity_1024th_rh = humidity(raw.humidity, t_fine, calibration);
  return measured;
}

}  // namespace kphi::ambient::bme280
