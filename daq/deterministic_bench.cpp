#include "daq/deterministic_bench.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "daq/device_records.hpp"
#include "drivers/device_error.hpp"

namespace kphi::daq {
namespace {

constexpr Duration kHandshake = std::chrono::seconds(5);
constexpr Duration kWorkEvery = std::chrono::milliseconds(50);
constexpr Duration kSyncEvery = std::chrono::seconds(1);
constexpr sim::Peer kHost = 1;

sim::BenchSettings settings_of(const profiles::Bench& place) {
  sim::BenchSettings settings;
  settings.seed = place.simulation ? place.simulation->seed : 1;
  settings.netbox.rate_hz = place.netbox.rate_hz;
  settings.netbox.records_per_datagram = place.netbox.records_per_datagram;
  settings.module_id = place.iq.module_id;
  return settings;
}

iq::Settings motor_settings(const profiles::MotorPlace& place) {
  iq::Settings settings;
  settings.module_id = place.module_id;
  settings.telemetry_hz = place.telemetry_hz;
  settings.reply_timeout = std::chrono::milliseconds(100);
  settings.wire_byte_time = from_seconds(10.0 / place.baud);
  return settings;
}

netbox::StreamSettings stream_settings(const netbox::Configuration& box) {
  netbox::StreamSettings settings;
  settings.buffered = box.records_per_datagram > 1;
  settings.divisor = box.divisor;
  settings.records_per_datagram = box.records_per_datagram;
  settings.reply_timeout = std::chrono::milliseconds(100);
  return settings;
}

std::string body_of(const std::string& response) {
  const std::size_t blank = response.find("\r\n\r\n");
  return blank == std::string::npos ? std::string() : response.substr(blank + 4);
}

class WithinWaits final : public Background {
 public:
  WithinWaits(std::function<void()> work, std::function<void()>*& place) : work_(std::move(work)), place_(place) {
    place_ = &work_;
  }
  ~WithinWaits() override { place_ = nullptr; }

 private:
  std::function<void()> work_;
  std::function<void()>*& place_;
};

}  // namespace

DeterministicBench::DeterministicBench(const profiles::Bench& place)
    : sim_(settings_of(place)), motor_(motor_settings(place.iq)) {
  motor_.connect(clock_.now());
  while (motor_.state() == iq::Session::State::connecting) step_to(clock_.now() + std::chrono::milliseconds(1));
  if (motor_.state() != iq::Session::State::ready) throw DeviceError("IQ module", "connect", motor_.failure());
}

void DeterministicBench::wait_until(Instant when) {
  const Duration datagram = from_seconds(40.0 / 7000.0);
  while (clock_.now() < when) {
    Instant next = std::min(when, clock_.now() + datagram);
    next = std::min(next, motor_.deadline());
    if (stream_) next = std::min({next, stream_->deadline(), stream_->release_deadline()});
    step_to(std::max(next, clock_.now() + Duration(1)));
    if (work_ && clock_.now() >= next_work_) {
      (*work_)();
      next_work_ = clock_.now() + kWorkEvery;
    }
  }
}

void DeterministicBench::step_to(Instant when) {
  clock_.set(when);
  sim_.advance(when);
  exchange();  // what came is received before anything is found to be late
  motor_.advance(when);
  if (stream_) {
    stream_->release(when, records_);
    stream_->advance(when);
  }
  exchange();
}

void DeterministicBench::exchange() {
  exchange_motor();
  exchange_load_cell();
}

void DeterministicBench::exchange_motor() {
  for (;;) {
    const std::size_t asked = motor_.output().size();
    sim_.motor().receive(motor_.output(), clock_.now());
    motor_.sent(asked);
    auto& reply = sim_.motor().output();
    if (asked == 0 && reply.empty()) return;
    motor_.receive(reply, clock_.now());
    reply.clear();
  }
}

void DeterministicBench::exchange_load_cell() {
  if (stream_) {
    std::array<std::uint8_t, 8> request{};
    while (stream_->next_request(request)) sim_.netbox().receive(request, kHost);
  }
  sim::Datagram datagram;
  while (sim_.netbox().next_datagram(datagram)) {
    if (stream_) stream_->receive(datagram.payload(), clock_.now(), records_);
  }
}

std::unique_ptr<Background> DeterministicBench::keep_calling(std::function<void()> work) {
  return std::make_unique<WithinWaits>(std::move(work), work_);
}

Duration DeterministicBench::sync_interval() const { return kSyncEvery; }

void DeterministicBench::mounted(const std::string& propeller_id, double occlusion_deg) {
  try {
    sim_.mount(propeller_id, occlusion_deg);
  } catch (const std::invalid_argument& e) {
    throw DeviceError("simulated bench", "mount", e.what());
  }
}

void DeterministicBench::spin_at(RadPerSec signed_speed) {
  motor_.spin_at(signed_speed, clock_.now());
  exchange_motor();
}

// One thread: who asks for a speed cannot die apart from who watches it.
void DeterministicBench::renew() noexcept {}

void DeterministicBench::coast() noexcept {
  motor_.coast(clock_.now());
  exchange_motor();
}

std::size_t DeterministicBench::take(std::span<results::MotorReading> out) {
  std::array<iq::Reading, 64> readings;
  const std::size_t n = motor_.take(std::span(readings).first(std::min(out.size(), readings.size())));
  for (std::size_t i = 0; i < n; ++i) out[i] = to_reading(readings[i]);
  return n;
}

std::string DeterministicBench::identity() const { return motor_.identity().summary(); }

results::LoadCellScale DeterministicBench::start() {
  configuration_ = netbox::parse_configuration(body_of(sim_.netbox().http("GET /netftapi2.xml HTTP/1.0\r\n\r\n")));
  stream_.emplace(stream_settings(configuration_));
  records_.clear();
  taken_ = 0;
  stream_->start(clock_.now());
  const Instant give_up = clock_.now() + kHandshake;
  while (stream_->state() != netbox::State::streaming && clock_.now() < give_up) {
    step_to(clock_.now() + std::chrono::milliseconds(1));
  }
  if (stream_->state() != netbox::State::streaming) throw DeviceError("Net Box", "start the stream", "no record came");
  return to_scale(configuration_);
}

void DeterministicBench::stop() noexcept {
  stream_->flush(records_);
  stream_->stop(clock_.now());
  exchange_load_cell();
}

std::size_t DeterministicBench::take(std::span<results::LoadCellRecord> out) {
  const std::size_t n = std::min(out.size(), records_.size() - taken_);
  for (std::size_t i = 0; i < n; ++i) out[i] = to_record(records_[taken_ + i]);
  taken_ += n;
  if (taken_ == records_.size()) {
    records_.clear();
    taken_ = 0;
  }
  return n;
}

results::SampleAccount DeterministicBench::account() const { return to_account(stream_->counters()); }

std::string DeterministicBench::failure() const {
  if (motor_.state() == iq::Session::State::failed) return "motor: " + motor_.failure();
  if (stream_ && stream_->state() == netbox::State::silent) return "load cell: the stream fell silent";
  return "";
}

}  // namespace kphi::daq
