#include "drivers/sim/control_line.hpp"

#include <fmt/format.h>

#include <boost/asio/local/stream_protocol.hpp>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "base/error.hpp"
#include "base/number.hpp"
#include "drivers/sim/truth_log.hpp"

namespace kphi::sim {
namespace {

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

std::string hang(SimulatedBench& bench, const std::string& axis, const std::string& force) {
  const auto newtons = parse_double(force);
  const std::size_t index = std::string_view("xyz").find(axis);
  if (axis.size() != 1 || index == std::string_view::npos || !newtons) return "error expected: hang x|y|z NEWTONS";
  try {
    bench.hang(static_cast<int>(index), *newtons);
  } catch (const std::invalid_argument& refusal) {
    return std::string("error ") + refusal.what();
  }
  return fmt::format("ok {} {}", axis, *newtons);
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
    const Fault fault = fault_of(entry);
    if (!on_supply(fault.kind)) return "error only faults of the supply can be added";
    bench.supply()->add_fault(fault);
  } catch (const FaultEntryError& error) {
    return std::string("error ") + error.what();
  }
  return fmt::format("ok {}", entry["at_s"]);
}

}  // namespace

std::string control_answer(SimulatedBench& bench, std::string_view line) {
  std::istringstream in{std::string(line)};
  const std::vector<std::string> words(std::istream_iterator<std::string>(in), {});
  if (words.size() == 3 && words[0] == "mount") return mount(bench, words[1], words[2]);
  if (words.size() == 3 && words[0] == "hang") return hang(bench, words[1], words[2]);
  if (words.size() == 1 && words[0] == "status") return status(bench);
  if (words.size() > 1 && words[0] == "fault") return fail(bench, words);
  return "error unknown command; use `mount PROPELLER DEGREES`, `hang AXIS NEWTONS`, `status` or `fault "
         "kind=supply_...`";
}

std::string control_path(const std::string& configured) {
  const std::filesystem::path path(configured);
  return path.is_absolute() ? path.string() : (std::filesystem::temp_directory_path() / path).string();
}

std::string tell(const std::string& path, const std::string& line) {
  using boost::asio::local::stream_protocol;
  stream_protocol::iostream simulator;
  simulator.expires_after(std::chrono::seconds(3));
  const char* step = "connect";
  try {
    simulator.connect(stream_protocol::endpoint(path));
    if (simulator) step = "wait for an answer";
    simulator << line << std::endl;
    std::string answer;
    if (std::getline(simulator, answer) && !simulator.eof()) return answer;
    throw boost::system::system_error(simulator.error());
  } catch (const boost::system::system_error& error) {
    throw DeviceError("simulated bench " + path, step, error.code().message(), "start it with: kphi sim BENCH");
  }
}

}  // namespace kphi::sim
