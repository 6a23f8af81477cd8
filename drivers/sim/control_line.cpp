#include "drivers/sim/control_line.hpp"

#include <fmt/format.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "base/descriptor.hpp"
#include "base/error.hpp"
#include "base/number.hpp"
#include "drivers/sim/transport/conversations.hpp"
#include "drivers/sim/truth_log.hpp"

namespace kphi::sim {
namespace {

std::vector<std::string> words_of(std::string_view line) {
  std::istringstream in{std::string(line)};
  return {std::istream_iterator<std::string>(in), {}};
}

std::string mount(SimulatedBench& bench, const std::string& propeller, const std::string& angle) {
  const auto occlusion_deg = parse_double(angle);
  if (!occlusion_deg) return "error \"" + angle + "\" is not an angle in degrees";
  try {
    bench.mount(propeller, *occlusion_deg);
  } catch (const std::invalid_argument& refusal) {
    return std::string("error ") + refusal.what();
  }
  return "ok " + bench.mounted();
}

std::string status(SimulatedBench& bench) {
  const auto& drive = bench.motor().drive();
  nlohmann::ordered_json json{{"mounted", bench.mounted()},
                              {"bench_time_s", static_cast<double>(bench.ticks()) * kTick},
                              {"speed_rad_s", bench.plant().motor().speed},
                              {"thrust_n", bench.plant().thrust()},
                              {"coil_celsius", bench.plant().motor().coil_celsius},
                              {"streaming", bench.netbox().streaming()},
                              {"samples_sent", bench.netbox().records_sent()},
                              {"motor_timeouts", bench.motor().timeouts()},
                              {"drive", {{"mode", name_of(drive.mode)}, {"target", drive.target}}},
                              {"last_motion_command_s", nullptr}};
  const Instant last = bench.motor().last_motion().at;
  if (last >= Instant{0}) json["last_motion_command_s"] = to_seconds(last);
  if (SupplySlave* supply = bench.supply()) {
    const SupplyCircuit& circuit = supply->circuit();
    json["supply"] = {{"output", circuit.output()}, {"volts", circuit.volts()}, {"amps", circuit.amps()}};
  }
  return json.dump();
}

/// "kind=supply_trip code=1": of the supply, from now on.
std::string fail(SimulatedBench& bench, std::vector<std::string> words) {
  if (bench.supply() == nullptr) return "error this bench has no supply";
  FaultEntry entry{{"at_s", fmt::format("{}", static_cast<double>(bench.ticks()) * kTick)}};
  for (std::size_t i = 1; i < words.size(); ++i) {
    const std::size_t equals = words[i].find('=');
    if (equals == std::string::npos) return "error \"" + words[i] + "\" is not key=value";
    entry[words[i].substr(0, equals)] = words[i].substr(equals + 1);
  }
  try {
    bench.supply()->add_fault(supply_faults().read(entry));
  } catch (const FaultEntryError& error) {
    return std::string("error ") + error.what();
  }
  return fmt::format("ok {}", entry["at_s"]);
}

}  // namespace

std::string control_answer(SimulatedBench& bench, std::string_view line) {
  const auto words = words_of(line);
  if (words.size() == 3 && words[0] == "mount") return mount(bench, words[1], words[2]);
  if (words.size() == 1 && words[0] == "status") return status(bench);
  if (words.size() > 1 && words[0] == "fault") return fail(bench, words);
  return "error say 'mount PROPELLER DEGREES', 'status' or 'fault kind=supply_...'";
}

std::string control_path(const std::string& configured) {
  const std::filesystem::path path(configured);
  return path.is_absolute() ? path.string() : (std::filesystem::temp_directory_path() / path).string();
}

std::string tell(const std::string& path, const std::string& line) {
  const auto refuse = [&](const char* operation, const std::string& cause) -> DeviceError {
    return {"simulated bench " + path, operation, cause, "start it with: kphi sim BENCH"};
  };
  const auto address = unix_address(path);
  if (!address) throw refuse("connect", "the path is empty or longer than a socket path may be");
  const Descriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const timeval patience{3, 0};
  ::setsockopt(socket.number(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  if (::connect(socket.number(), reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0) {
    throw refuse("connect", std::strerror(errno));
  }
  const std::string question = line + "\n";
  if (::send(socket.number(), question.data(), question.size(), MSG_NOSIGNAL) !=
      static_cast<ssize_t>(question.size())) {
    throw refuse("send", std::strerror(errno));
  }
  std::string answer;
  std::array<char, 512> bytes{};
  while (answer.find('\n') == std::string::npos) {
    const ssize_t count = ::recv(socket.number(), bytes.data(), bytes.size(), 0);
    if (count < 0 && errno == EINTR) continue;
    if (count == 0) throw refuse("wait for an answer", "the connection was closed");
    if (count < 0) throw refuse("wait for an answer", std::strerror(errno));
    answer.append(bytes.data(), static_cast<std::size_t>(count));
  }
  return answer.substr(0, answer.find('\n'));
}

}  // namespace kphi::sim
