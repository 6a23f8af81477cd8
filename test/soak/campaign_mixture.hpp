// One short campaign and all that goes wrong in it, drawn from a seed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "test/soak/absent_box.hpp"

namespace kphi::soak {

/// From its n-th operation on the disk refuses: so many operations, or all.
struct DiskRefusal {
  std::uint64_t from = 1;
  std::uint64_t operations = 0;  ///< 0: for ever
};

/// The program is killed, as by kill -9.
struct Kill {
  /// `write`: after a file operation, while it writes: a part of that reaches the disk.
  enum class At : std::uint8_t { step, file_operation, prompt, write };
  At at = At::step;
  std::uint64_t number = 1;  ///< of the bench's steps of time, of file operations, of prompts; the first is 1
};

/// The computer sleeps.
struct HostSleep {
  Instant at{0};  ///< the first step of the bench from then on
  Duration lasts{0};
};

struct Mixture {
  std::uint64_t seed = 0;
  int life = 1;          ///< of the campaign: the second goes on with what the first left
  std::string campaign;  ///< YAML
  std::string bench;     ///< YAML without the path of the fault script
  std::string faults;    ///< YAML: a whole fault script
  double lasts_s = 0;    ///< about, of bench time
  std::string answers;   ///< what the operator types; then end of file. From the second life on, what he is asked for
  bool answers_are_good = true;
  std::optional<double> mounted_instead_deg;  ///< at the second mounting the operator says yes and mounts this
  std::optional<DiskRefusal> disk;
  std::optional<Kill> kill;
  std::optional<Instant> interrupt;  ///< Ctrl-C
  std::optional<HostSleep> sleep;
  std::optional<Absence> absence;  ///< of the box, in a stream after the first life
  bool faults_are_others = false;  ///< than those of the life before
  bool accepts_changes = false;    ///< --accept-changes

  /// Nothing at all goes wrong.
  [[nodiscard]] bool is_clean() const;
};

[[nodiscard]] Mixture draw(std::uint64_t seed);

/// The same campaign on the same bench, resumed: the disk works again, or refuses anew, and so on.
[[nodiscard]] Mixture draw_resumed(const Mixture& former);

/// As a person reads it: a fault script, with all else as comments.
[[nodiscard]] std::string words(const Mixture& mixture);

}  // namespace kphi::soak
