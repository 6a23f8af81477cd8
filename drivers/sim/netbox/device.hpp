// The other end of the load cell's wire: an ATI Net Box as bytes in and bytes out. No socket, clock or thread.
// Byte layout: Net F/T manual, RDT request and record. Answers to open questions: NetBoxQuirks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <string_view>

#include "drivers/sim/netbox/settings.hpp"
#include "drivers/sim/netbox/signal.hpp"
#include "drivers/sim/physics/plant.hpp"

namespace kphi::sim {

/// Sender of a datagram; the transport gives it a meaning.
using Peer = std::uint64_t;

inline constexpr std::size_t kRecordBytes = 36;
inline constexpr std::size_t kRecordsPerDatagramMax = 40;
/// Room for the largest datagram that a fault makes up: one record too many.
inline constexpr std::size_t kDatagramBytesMax = kRecordBytes * (kRecordsPerDatagramMax + 1);

struct Datagram {
  Peer peer = 0;
  Instant at{0};             ///< bench time of its last record; from a FaultInjector: of its arrival
  std::uint32_t boot = 0;    ///< power-ups of the box before it was written
  std::uint32_t stream = 0;  ///< starts that the box obeyed before it was written, since it was made
  bool foreign = false;      ///< not from the box's address
  std::size_t size = 0;
  std::array<std::uint8_t, kDatagramBytesMax> bytes{};
  std::array<Instant, kRecordsPerDatagramMax> sampled{};  ///< bench time of each record
  [[nodiscard]] std::span<const std::uint8_t> payload() const noexcept { return {bytes.data(), size}; }
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
  /// Complete HTTP/1.0 answer to one complete request; the box closes the connection after it. Pages: netftapi2.xml and
  /// netftcalapi.xml, with or without ?index=0..15, setting.cgi and comm.cgi; 404 for anything else. Empty: it closes
  /// the connection without a word.
  [[nodiscard]] std::string http(std::string_view request);
  /// Takes whole commands of 20 bytes off the front of `received` and returns the answers to them.
  [[nodiscard]] std::string tcp(std::string& received) const;

  // What happens to a box.
  /// Off and on: counts from 0 again; settings that live in its memory only are gone. `resume`: it streams again.
  void power_cycle(bool resume);
  /// Stops the acquisition: records repeat sample and ft_sequence.
  void stall(bool stalled) noexcept { stalled_ = stalled; }
  void set_ft_sequence(std::uint32_t next) noexcept { ft_sequence_ = next - 1; }
  [[nodiscard]] std::uint32_t ft_sequence() const noexcept { return ft_sequence_; }  ///< of the last sample
  /// Restarts the stream's numbering without a request.
  void restart_stream() noexcept;
  /// ORed into every status word until cleared.
  void set_status(std::uint32_t bits) noexcept { forced_status_ |= bits; }
  void clear_status(std::uint32_t bits) noexcept { forced_status_ &= ~bits; }
  void force_saturation(unsigned axes) noexcept { signal_.force_saturation(axes); }
  void freeze(unsigned axes) noexcept { signal_.freeze(axes); }
  /// As written through the web pages: quantised and clamped silently.
  void configure(const NetBoxSettings& settings);

  [[nodiscard]] bool streaming() const noexcept { return streaming_; }
  [[nodiscard]] int divisor() const noexcept { return divisor_; }
  [[nodiscard]] std::uint32_t status() const noexcept { return status_; }
  [[nodiscard]] std::uint64_t records_sent() const noexcept { return records_sent_; }
  [[nodiscard]] const NetBoxSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] const NetBoxSignal& signal() const noexcept { return signal_; }
  /// Largest and smallest counts since power-up.
  [[nodiscard]] const std::array<std::int32_t, 6>& peaks_high() const noexcept { return peaks_high_; }
  [[nodiscard]] const std::array<std::int32_t, 6>& peaks_low() const noexcept { return peaks_low_; }

 private:
  void start(Peer peer, int records_per_datagram, std::uint32_t sample_count) noexcept;
  void stop() noexcept;
  void measure(const Wrench& wrench) noexcept;
  void append_record(Instant at);
  std::string write(std::string_view page, std::string_view query);
  void append_calibration(std::string& out) const;

  NetBoxSettings settings_;
  NetBoxSignal signal_;
  int divisor_;
  std::uint32_t ft_sequence_;
  std::uint32_t status_ = 0;
  std::uint32_t forced_status_ = 0;
  bool stalled_ = false;
  std::array<std::int32_t, 6> peaks_high_{};
  std::array<std::int32_t, 6> peaks_low_{};
  std::uint32_t boots_ = 0;
  std::uint32_t streams_ = 0;

  bool streaming_ = false;
  bool finite_ = false;
  std::uint32_t remaining_ = 0;
  std::uint32_t rdt_sequence_ = 0;
  std::size_t records_per_datagram_ = 1;
  int ticks_to_record_ = 0;
  Datagram open_;

  std::deque<Datagram> waiting_;
  std::uint64_t records_sent_ = 0;
  std::uint64_t ticks_ = 0;  ///< since it was made

  /// Requests in seconds that begin with a request.
  struct PerSecond {
    std::uint64_t since = 0;  ///< tick of the first of the present second
    int n = 0;                ///< in that second
    /// How many there were in it with this one.
    int count(std::uint64_t tick) noexcept;
  };
  PerSecond requests_, writes_;
};

}  // namespace kphi::sim
