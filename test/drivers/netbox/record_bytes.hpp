// The tests' own writer of RDT records and of the box's XML: nothing of the driver's encoder in it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kphi::netbox::test {

using Bytes = std::vector<std::uint8_t>;

inline void put_u32(Bytes& bytes, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift & 0xff));
}

/// Fz is what is given, the other axes are zero.
inline void put_record(Bytes& bytes, std::uint32_t rdt, std::uint32_t ft, std::uint32_t status = 0,
                       std::int32_t fz = 0) {
  put_u32(bytes, rdt);
  put_u32(bytes, ft);
  put_u32(bytes, status);
  for (int axis = 0; axis < 6; ++axis) put_u32(bytes, axis == 2 ? static_cast<std::uint32_t>(fz) : 0u);
}

/// `count` records that follow each other.
inline Bytes records(std::uint32_t rdt, std::uint32_t ft, unsigned count = 1, unsigned stride = 1) {
  Bytes bytes;
  for (unsigned i = 0; i < count; ++i) put_record(bytes, rdt + i, ft + i * stride);
  return bytes;
}

/// netftapi2.xml as captured from a Delta SI-330-30 with firmware 2.2.59 (addresses and serials replaced).
inline std::string captured_xml() {
  return R"(<?xml version="1.0"?><netft>
<runstat>0x00000000</runstat><runrate>7000</runrate>
<runpkmx>15186840;15450145;20557075;1367250;2491043;1854244</runpkmx>
<runpkmn>-15529289;-16465881;-25931018;-3018564;-1881652;-729991</runpkmn>
<runmcb>0x00000000</runmcb><runmco>0x00</runmco><runmcl>0</runmcl>
<cfgnam>empty</cfgnam><cfgcalsel>0</cfgcalsel><cfgcalsn>FTxxxxx</cfgcalsn>
<scfgfu>N</scfgfu><scfgtu>Nm</scfgtu>
<cfgtfx>0;0;132.710;0;0;0</cfgtfx><scfgtdu>mm</scfgtdu><scfgtau>degrees</scfgtau>
<cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt>
<cfgmr>330;330;990;30;30;30</cfgmr><cfgusra>empty</cfgusra><cfgusrb>empty</cfgusrb>
<setcfgsel>0</setcfgsel><setpke>1</setpke><setmce>0</setmce>
<setbias>745;17;447;184;-596;-253</setbias>
<mce>1;1;0;0;0;0;0;0;0;0;0;0;0;0;0;0</mce>
<mcx>3;3;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1;-1</mcx>
<mcc>-1;1;1;1;1;1;1;1;1;1;1;1;1;1;1;1</mcc>
<mcv>100000;-10000;0;0;0;0;0;0;0;0;0;0;0;0;0;0</mcv>
<mco>0x01;0x00;0x00;0x00;0x00;0x00;0x00;0x00;0x00;0x00;0x00;0x00;0x00;0x00;0x00;0x00</mco>
<setuserfilter>0</setuserfilter>
<nethwaddr>00:16:BD:xx:xx:xx</nethwaddr><netip>192.168.1.11</netip>
<comnetip>192.168.1.11</comnetip><comnetdhcp>Enabled</comnetdhcp>
<comrdte>Enabled</comrdte><comrdtrate>100</comrdtrate><comrdtbsiz>1</comrdtbsiz>
<mfgdigsn>LOTxxxx</mfgdigsn><mfgdigver>2.2.59</mfgdigver>
</netft>)";
}

/// The capture with the content of one element replaced; the element goes when `content` is null.
inline std::string with(std::string xml, const std::string& element, const char* content) {
  const std::string opening = "<" + element + ">", closing = "</" + element + ">";
  const std::size_t begin = xml.find(opening), end = xml.find(closing);
  const std::string replacement = content ? opening + content + closing : "";
  if (begin == std::string::npos) return xml.insert(xml.find("</netft>"), replacement);
  return xml.replace(begin, end + closing.size() - begin, replacement);
}

/// The XML of a box that streams at 7000 / divisor records per second.
inline std::string streaming_xml(unsigned records_per_datagram = 40, unsigned divisor = 1) {
  const std::string rate = std::to_string(7000 / divisor), size = std::to_string(records_per_datagram);
  return with(with(captured_xml(), "comrdtrate", rate.c_str()), "comrdtbsiz", size.c_str());
}

}  // namespace kphi::netbox::test
