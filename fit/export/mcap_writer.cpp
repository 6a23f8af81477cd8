#include "fit/export/mcap_writer.hpp"

#include <boost/crc.hpp>
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

template <class Number>
void put_number(std::string& bytes, Number value) {
  for (std::size_t i = 0; i < sizeof(Number); ++i)
    bytes += static_cast<char>((static_cast<std::uint64_t>(value) >> (8 * i)) & 0xFFu);
}

void put_text(std::string& bytes, std::string_view text) {
  put_number(bytes, static_cast<std::uint32_t>(text.size()));
  bytes += text;
}

void put_map(std::string& bytes, const std::map<std::string, std::string>& map) {
  std::string entries;
  for (const auto& [key, value] : map) {
    put_text(entries, key);
    put_text(entries, value);
  }
  put_text(bytes, entries);  // a map is its length in bytes and its entries
}

std::string record(Opcode opcode, std::string_view content) {
  std::string bytes(1, static_cast<char>(opcode));
  put_number(bytes, static_cast<std::uint64_t>(content.size()));
  bytes += content;
  return bytes;
}

std::uint32_t crc_of(std::string_view bytes) {
  boost::crc_32_type crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

}  // namespace

McapWriter::McapWriter(std::ostream& out, std::string_view library) : out_(out) {
  put(kMagic);
  std::string content;
  put_text(content, "");  // no profile
  put_text(content, library);
  put(record(kHeader, content));
}

void McapWriter::put(std::string_view bytes) {
  out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  position_ += bytes.size();
}

std::uint16_t McapWriter::add_channel(std::string_view topic, std::string_view schema_name, std::string_view schema,
                                      const std::map<std::string, std::string>& metadata) {
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);  // 0 is no schema
  std::string content;
  put_number(content, id);
  put_text(content, schema_name);
  put_text(content, "jsonschema");
  put_text(content, schema);
  const std::string schema_record = record(kSchema, content);
  content.clear();
  put_number(content, id);
  put_number(content, id);
  put_text(content, topic);
  put_text(content, "json");
  put_map(content, metadata);
  channels_.push_back({record(kChannel, content), 0, 0, {}});
  schemas_ += schema_record;
  chunk_ += schema_record + channels_.back().record;
  return id;
}

void McapWriter::write(std::uint16_t channel, std::uint64_t time_ns, std::string_view json) {
  Channel& to = channels_.at(channel - 1u);
  std::string content;
  put_number(content, channel);
  put_number(content, to.sequence++);
  put_number(content, time_ns);
  put_number(content, time_ns);
  content += json;
  to.index.emplace_back(time_ns, chunk_.size());
  ++to.messages;
  chunk_span_.take(time_ns);
  span_.take(time_ns);
  chunk_ += record(kMessage, content);
  if (chunk_.size() >= kChunkBytes) finish_chunk();
}

void McapWriter::finish_chunk() {
  if (chunk_.empty()) return;
  if (chunk_span_.end < chunk_span_.begin) chunk_span_ = {0, 0};
  std::string content;
  put_number(content, chunk_span_.begin);
  put_number(content, chunk_span_.end);
  put_number(content, static_cast<std::uint64_t>(chunk_.size()));
  put_number(content, crc_of(chunk_));
  put_text(content, "");  // no compression
  put_number(content, static_cast<std::uint64_t>(chunk_.size()));
  content += chunk_;
  const std::uint64_t chunk_at = position_;
  put(record(kChunk, content));
  const std::uint64_t chunk_bytes = position_ - chunk_at, indexes_at = position_;

  std::string offsets;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (channels_[i].index.empty()) continue;
    const auto id = static_cast<std::uint16_t>(i + 1);
    put_number(offsets, id);
    put_number(offsets, position_);
    std::string index;
    put_number(index, id);
    put_number(index, static_cast<std::uint32_t>(16 * channels_[i].index.size()));
    for (const auto& [time, offset] : channels_[i].index) {
      put_number(index, time);
      put_number(index, offset);
    }
    put(record(kMessageIndex, index));
    channels_[i].index.clear();
  }
  content.clear();
  put_number(content, chunk_span_.begin);
  put_number(content, chunk_span_.end);
  put_number(content, chunk_at);
  put_number(content, chunk_bytes);
  put_text(content, offsets);
  put_number(content, position_ - indexes_at);
  put_text(content, "");
  put_number(content, static_cast<std::uint64_t>(chunk_.size()));
  put_number(content, static_cast<std::uint64_t>(chunk_.size()));
  chunk_indexes_ += record(kChunkIndex, content);
  ++chunks_;
  chunk_.clear();
  chunk_span_ = {};
}

void McapWriter::add_metadata(std::string_view name, const std::map<std::string, std::string>& values) {
  finish_chunk();
  std::string content;
  put_text(content, name);
  put_map(content, values);
  const std::uint64_t at = position_;
  put(record(kMetadata, content));
  content.clear();
  put_number(content, at);
  put_number(content, position_ - at);
  put_text(content, name);
  metadata_indexes_ += record(kMetadataIndex, content);
  ++metadata_;
}

void McapWriter::summarise() {
  const std::uint64_t summary_at = position_;
  std::string summary = schemas_;
  std::string counts;
  std::uint64_t messages = 0;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    summary += channels_[i].record;
    put_number(counts, static_cast<std::uint16_t>(i + 1));
    put_number(counts, channels_[i].messages);
    messages += channels_[i].messages;
  }
  if (messages == 0) span_ = {0, 0};
  std::string statistics;
  put_number(statistics, messages);
  put_number(statistics, static_cast<std::uint16_t>(channels_.size()));
  put_number(statistics, static_cast<std::uint32_t>(channels_.size()));
  put_number(statistics, std::uint32_t{0});  // attachments
  put_number(statistics, metadata_);
  put_number(statistics, chunks_);
  put_number(statistics, span_.begin);
  put_number(statistics, span_.end);
  put_text(statistics, counts);
  summary += record(kStatistics, statistics) + chunk_indexes_ + metadata_indexes_;
  put(summary);

  // The footer's checksum covers the summary and the footer up to itself.
  std::string footer;
  put_number(footer, summary_at);
  put_number(footer, std::uint64_t{0});  // no summary offsets
  std::string head(1, static_cast<char>(kFooter));
  put_number(head, static_cast<std::uint64_t>(footer.size() + 4));
  put_number(footer, crc_of(summary + head + footer));
  put(record(kFooter, footer));
}

void McapWriter::close() {
  finish_chunk();
  std::string content;
  put_number(content, std::uint32_t{0});  // no checksum of the data section
  put(record(kDataEnd, content));
  summarise();
  put(kMagic);
  out_.flush();
}

}  // namespace kphi::fit
