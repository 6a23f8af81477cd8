// Judges the status word of every load-cell sample: how long the box itself has reported samples that cannot be
// trusted. The limits on thrust, torque and ranges rest on these samples.
//
// Time is counted in samples. A sound sample takes one bad sample off the count, so that an error which comes and goes
// counts as one that lasts as soon as it shows in more than half of the samples.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/device_data.hpp"
#include "drivers/netbox/wire/status.hpp"

namespace kphi::daq {

class StatusWatch {
 public:
  enum class State : std::uint8_t {
    trusted,    ///< sound, or an error within its patience
    lasting,    ///< saturated, or trouble with a network, for kLasting: no motor may turn on such samples
    untrusted,  ///< a faulty box, for longer than one datagram: neither a motor nor a zero may rest on such samples
  };
  static constexpr double kLasting = 0.5;  ///< s; at least one datagram

  StatusWatch(netbox::Product product, int records_per_datagram, double sample_rate_hz);

  State take(const LoadCellRecord& sample);
  /// The first error of the run and its end, once each; else nullopt. Errors that other events report are left out:
  /// saturation (near_range, beyond_range) and a Net Box's trouble with RDT or its network (box_trouble).
  [[nodiscard]] std::optional<StreamEvent> take_event();
  /// Why the samples cannot be trusted, one line; after take() has given `lasting` or `untrusted`.
  [[nodiscard]] std::string reason() const;

 private:
  /// Bad samples minus sound ones, from 0 to `patience` + 1.
  struct Count {
    std::uint64_t patience = 1, value = 0;
    void add(bool bad) noexcept;
    [[nodiscard]] bool is_over() const noexcept { return value > patience; }
  };
  /// From a bad sample until as many sound ones have followed.
  struct Episode {
    std::uint64_t samples = 0, bad = 0;
    Nanoseconds sound_since = 0;
    bool told = false;
  };

  void note_error(const LoadCellRecord& sample);
  void note_end();
  [[nodiscard]] std::string error() const;

  const netbox::Product product_;
  const double sample_rate_hz_;
  Count faulty_, bad_;
  Episode episode_;
  std::uint32_t status_ = 0;  ///< of the newest bad sample
  bool told_ = false;         ///< an error of this run was reported
  std::optional<StreamEvent> event_;
};

}  // namespace kphi::daq
