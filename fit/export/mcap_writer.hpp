// MCAP, version 0, as Foxglove and PlotJuggler read it: JSON messages in uncompressed chunks with their indexes and
// checksums. Specification: mcap.dev/spec.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kphi::fit {

class McapWriter {
 public:
  /// Writes the head of the file. `out` outlives the writer and is binary.
  McapWriter(std::ostream& out, std::string_view library);
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// A topic of JSON messages. `schema` is a JSON Schema, `metadata` adds to it (units).
  std::uint16_t add_channel(std::string_view topic, std::string_view schema_name, std::string_view schema,
                            const std::map<std::string, std::string>& metadata = {});
  /// `time_ns` since 1970, UTC.
  void write(std::uint16_t channel, std::uint64_t time_ns, std::string_view json);
  void add_metadata(std::string_view name, const std::map<std::string, std::string>& values);
  /// Writes summary and end. Without it readers report a truncated file.
  void close();

 private:
  struct Channel {
    std::string record;  ///< of the channel, for the summary
    std::uint32_t sequence = 0;
    std::uint64_t messages = 0;
    std::vector<std::pair<std::uint64_t, std::uint64_t>> index;  ///< of the open chunk: time, offset
  };
  struct Span {
    std::uint64_t begin = UINT64_MAX, end = 0;
    void take(std::uint64_t time) {
      begin = time < begin ? time : begin;
      end = time > end ? time : end;
    }
  };

  void write_out(std::string_view bytes);
  void finish_chunk();

  std::ostream& out_;
  std::uint64_t position_ = 0;
  std::string schemas_;
  std::vector<Channel> channels_;  ///< id − 1
  std::string chunk_;
  Span chunk_span_, span_;
  std::string chunk_indexes_, metadata_indexes_;
  std::uint32_t chunks_ = 0, metadata_ = 0;
};

}  // namespace kphi::fit
