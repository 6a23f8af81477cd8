#include "fit/export/mcap_writer.hpp"

#include <boost/crc.hpp>
#include <concepts>
#include <ostream>

namespace kphi::fit {
namespace {

constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
constexpr std::size_t kChunkBytes = 1 << 20;

enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kDataEnd = 0x0F,
};

void put(std::string& bytes, std::unsigned_integral auto value) {
  for (std::size_t i = 0; i < sizeof value; ++i)
    bytes += static_cast<char>((static_cast<std::uint64_t>(value) >> (8 * i)) & 0xFFu);
}

/// Its length, and the text.
void put(std::string& bytes, std::string_view text) {
  put(bytes, static_cast<std::uint32_t>(text.size()));
  bytes += text;
}

/// Without a length.
struct Raw {
  std::string_view bytes;
};
void put(std::string& bytes, const Raw& raw) { bytes += raw.bytes; }

template <class... Fields>
std::string packed(const Fields&... fields) {
  std::string bytes;
  (put(bytes, fields), ...);
  return bytes;
}

/// A map is its length in bytes and its entries.
std::string packed_map(const std::map<std::string, std::string>& map) {
  std::string entries;
  for (const auto& [key, value] : map) entries += packed(key, value);
  return entries;
}

template <class... Fields>
std::string record(Opcode opcode, const Fields&... fields) {
  const std::string content = packed(fields...);
  return packed(std::uint8_t{opcode}, std::uint64_t{content.size()}) + content;
}

std::uint32_t crc_of(std::string_view bytes) {
  boost::crc_32_type crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

}  // namespace

McapWriter::McapWriter(std::ostream& out, std::string_view library) : out_(out) {
  write_out(kMagic);
  write_out(record(kHeader, "", library));  // no profile
}

void McapWriter::write_out(std::string_view bytes) {
  out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  position_ += bytes.size();
}

std::uint16_t McapWriter::add_channel(std::string_view topic, std::string_view schema_name, std::string_view schema,
                                      const std::map<std::string, std::string>& metadata) {
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);  // 0 is no schema
  const std::string schema_record = record(kSchema, id, schema_name, "jsonschema", schema);
  channels_.push_back({record(kChannel, id, id, topic, "json", packed_map(metadata)), 0, 0, {}});
  schemas_ += schema_record;
  chunk_ += schema_record + channels_.back().record;
  return id;
}

void McapWriter::write(std::uint16_t channel, std::uint64_t time_ns, std::string_view json) {
  Channel& to = channels_.at(channel - 1u);
  to.index.emplace_back(time_ns, chunk_.size());
  ++to.messages;
  chunk_span_.take(time_ns);
  span_.take(time_ns);
  chunk_ += record(kMessage, channel, to.sequence++, time_ns, time_ns, Raw{json});
  if (chunk_.size() >= kChunkBytes) finish_chunk();
}

void McapWriter::finish_chunk() {
  if (chunk_.empty()) return;
  if (chunk_span_.end < chunk_span_.begin) chunk_span_ = {0, 0};
  const std::uint64_t size = chunk_.size(), chunk_at = position_;
  const std::string_view no_compression;
  write_out(
      record(kChunk, chunk_span_.begin, chunk_span_.end, size, crc_of(chunk_), no_compression, size, Raw{chunk_}));
  const std::uint64_t indexes_at = position_;
  std::string offsets;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (channels_[i].index.empty()) continue;
    const auto id = static_cast<std::uint16_t>(i + 1);
    offsets += packed(id, position_);
    std::string index;
    for (const auto& [time, offset] : channels_[i].index) index += packed(time, offset);
    write_out(record(kMessageIndex, id, index));
    channels_[i].index.clear();
  }
  chunk_indexes_ += record(kChunkIndex, chunk_span_.begin, chunk_span_.end, chunk_at, indexes_at - chunk_at, offsets,
                           position_ - indexes_at, no_compression, size, size);
  ++chunks_;
  chunk_.clear();
  chunk_span_ = {};
}

void McapWriter::add_metadata(std::string_view name, const std::map<std::string, std::string>& values) {
  finish_chunk();
  const std::uint64_t at = position_;
  write_out(record(kMetadata, name, packed_map(values)));
  metadata_indexes_ += record(kMetadataIndex, at, position_ - at, name);
  ++metadata_;
}

void McapWriter::close() {
  finish_chunk();
  write_out(record(kDataEnd, std::uint32_t{0}));  // no checksum of the data section
  constexpr std::uint32_t kAttachments = 0;
  constexpr std::uint64_t kSummaryOffsets = 0, kFooterBytes = 20;
  const std::uint64_t summary_at = position_;
  std::string summary = schemas_, counts;
  std::uint64_t messages = 0;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    summary += channels_[i].record;
    counts += packed(static_cast<std::uint16_t>(i + 1), channels_[i].messages);
    messages += channels_[i].messages;
  }
  if (messages == 0) span_ = {0, 0};
  const auto channels = static_cast<std::uint32_t>(channels_.size());
  summary += record(kStatistics, messages, static_cast<std::uint16_t>(channels), channels, kAttachments, metadata_,
                    chunks_, span_.begin, span_.end, counts) +
             chunk_indexes_ + metadata_indexes_;
  // The footer's checksum covers the summary and the footer up to itself.
  const std::string footer = packed(std::uint8_t{kFooter}, kFooterBytes, summary_at, kSummaryOffsets);
  write_out(summary + footer + packed(crc_of(summary + footer)));
  write_out(kMagic);
  out_.flush();
}

}  // namespace kphi::fit
