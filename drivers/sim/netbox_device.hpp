// The other end of the load cell's wire: an ATI Net Box as bytes in and bytes out. No socket, clock or thread.
// Byte layout: Net F/T manual, RDT request and record; answers to open questions are the suggested ones of the facts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim/load_cell.hpp"

namespace kphi::sim {

/// Whoever sent a datagram; the transport gives it a meaning.
using Peer = std::uint64_t;

inline constexpr std::size_t kRecordBytes = 36;
inline constexpr std::size_t kRecordsPerDatagramMax = 40;

struct Datagram {
  Peer peer = 0;
  Instant at{0};  ///< bench time of its last record
  std::size_t size = 0;
  std::array<std::uint8_t, kRecordBytes * kRecordsPerDatagramMax> bytes{};
  [[nodiscard]] std::span<const std::uint8_t> payload() const noexcept { return {bytes.data(), size}; }
};

struct NetBoxSettings {
  double rate_hz = 7000;                       ///< comrdtrate as asked for; the box rounds up to 7000/n
  int records_per_datagram = 40;               ///< comrdtbsiz, 1..40
  std::uint32_t first_ft_sequence = 0;         ///< of the first sample after power-up
  Wrench range{20, 20, 60, 1, 1, 1};           ///< N and N m: Mini40 SI-20-1
  std::int32_t counts_per_force = 1'000'000;   ///< per N
  std::int32_t counts_per_torque = 1'000'000;  ///< per N m
  std::string serial = "FT21001";              ///< of the calibration
  std::string address = "127.0.0.1";           ///< as the box reports it
};

class NetBoxDevice {
 public:
  explicit NetBoxDevice(const NetBoxSettings& settings);

  /// An RDT request, or anything else, which is ignored. The newest command wins, also from another peer.
  void receive(std::span<const std::uint8_t> datagram, Peer peer);
  /// One internal sample; 7000 of them are one second of the box's time.
  void sample(const LoadCellSample& sample);
  /// Next datagram to send, oldest first; false when there is none.
  bool next_datagram(Datagram& out);
  /// Complete answer to one complete HTTP request; the box closes the connection after it.
  [[nodiscard]] std::string http(std::string_view request) const;

  [[nodiscard]] bool streaming() const noexcept { return streaming_; }
  [[nodiscard]] int divisor() const noexcept { return divisor_; }
  [[nodiscard]] std::uint32_t status() const noexcept { return status_; }
  [[nodiscard]] std::uint64_t records_sent() const noexcept { return records_sent_; }
  [[nodiscard]] std::uint64_t requests_ignored() const noexcept { return requests_ignored_; }
  [[nodiscard]] const NetBoxSettings& settings() const noexcept { return settings_; }
  /// Largest and smallest counts since power-up.
  [[nodiscard]] const std::array<std::int32_t, 6>& peaks_high() const noexcept { return peaks_high_; }
  [[nodiscard]] const std::array<std::int32_t, 6>& peaks_low() const noexcept { return peaks_low_; }

 private:
  void start(Peer peer, int records_per_datagram, std::uint32_t sample_count) noexcept;
  void stop() noexcept;
  void measure(const Wrench& wrench) noexcept;
  void append_record(Instant at);
  void close_datagram();

  NetBoxSettings settings_;
  int divisor_;
  std::uint32_t ft_sequence_;
  std::uint32_t status_ = 0;
  std::array<std::int32_t, 6> counts_{};
  std::array<std::int32_t, 6> bias_{};
  std::array<std::int32_t, 6> peaks_high_{};
  std::array<std::int32_t, 6> peaks_low_{};

  bool streaming_ = false;
  bool finite_ = false;
  std::uint32_t remaining_ = 0;
  std::uint32_t rdt_sequence_ = 0;
  std::size_t records_per_datagram_ = 1;
  int ticks_to_record_ = 0;
  Datagram open_;

  struct Waiting {
    Peer peer;
    Instant at;
    std::size_t offset;  ///< into waiting_bytes_
    std::size_t size;
  };
  std::vector<Waiting> waiting_;
  std::vector<std::uint8_t> waiting_bytes_;
  std::size_t next_ = 0;
  std::uint64_t records_sent_ = 0;
  std::uint64_t requests_ignored_ = 0;
};

}  // namespace kphi::sim
