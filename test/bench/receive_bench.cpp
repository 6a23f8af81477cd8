// What a record costs this process on its way from the kernel to the consumer, against a loop that only receives and
// swaps bytes; both fed the same datagrams over loopback. Goal: at most 1.5 times as much.
#include <benchmark/benchmark.h>
#include <sys/socket.h>
#include <time.h>

#include <boost/endian/conversion.hpp>
#include <cstring>
#include <vector>

#include "drivers/clock.hpp"
#include "drivers/netbox/session.hpp"
#include "drivers/netbox/udp_socket.hpp"
#include "test/drivers/netbox/fake_box.hpp"

namespace {

using namespace kphi;
using namespace kphi::netbox;

constexpr unsigned kDatagrams = 64;

double thread_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Sends bursts to a socket under test.
class Sender {
 public:
  Sender() : box_(SOCK_DGRAM) {}
  std::uint16_t port() const { return box_.port(); }
  void learn_peer(UdpSocket& socket) {
    const std::uint8_t hello[8]{};
    socket.send(hello);
    std::uint8_t bytes[8];
    socklen_t length = sizeof peer_;
    recvfrom(box_.descriptor(), bytes, sizeof bytes, 0, reinterpret_cast<sockaddr*>(&peer_), &length);
  }
  void burst(unsigned records_per_datagram) {
    for (unsigned i = 0; i < kDatagrams; ++i) {
      const test::Bytes datagram = test::records(next_, next_, records_per_datagram);
      next_ += records_per_datagram;
      sendto(box_.descriptor(), datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&peer_), sizeof peer_);
    }
  }

 private:
  test::LoopbackSocket box_;
  sockaddr_in peer_{};
  std::uint32_t next_ = 1;
};

double bare_loop(UdpSocket& socket, std::uint64_t& records) {
  static std::array<std::array<std::uint8_t, 1500>, kDatagrams> bytes;
  static std::array<std::array<std::uint32_t, 9 * kMaxRecords>, kDatagrams> words;
  std::array<iovec, kDatagrams> vectors{};
  std::array<mmsghdr, kDatagrams> headers{};
  for (unsigned i = 0; i < kDatagrams; ++i) {
    vectors[i] = {bytes[i].data(), bytes[i].size()};
    headers[i].msg_hdr.msg_iov = &vectors[i];
    headers[i].msg_hdr.msg_iovlen = 1;
  }
  const double begun = thread_cpu_seconds();
  const int count = recvmmsg(socket.native_handle(), headers.data(), kDatagrams, MSG_DONTWAIT, nullptr);
  for (int i = 0; i < count; ++i) {
    const auto slot = static_cast<std::size_t>(i);
    const std::size_t size = headers[slot].msg_len / 4;
    for (std::size_t w = 0; w < size; ++w) words[slot][w] = boost::endian::load_big_u32(bytes[slot].data() + 4 * w);
    records += size / 9;
  }
  benchmark::DoNotOptimize(words);
  return thread_cpu_seconds() - begun;
}

double driver_loop(UdpSocket& socket, const Clock& clock, Session& session, std::vector<StampedRecord>& out) {
  out.clear();
  const double begun = thread_cpu_seconds();
  for (const UdpSocket::Datagram& datagram : socket.receive()) {
    session.note_host_drops(datagram.dropped);
    session.receive(datagram.bytes, clock.at_realtime(datagram.stamp), out);
  }
  benchmark::DoNotOptimize(out.data());
  return thread_cpu_seconds() - begun;
}

void receive(benchmark::State& state) {
  const auto per_datagram = static_cast<unsigned>(state.range(0));
  const SteadyClock clock;
  Sender to_bare, to_driver;
  UdpSocket bare("127.0.0.1", to_bare.port()), driver("127.0.0.1", to_driver.port());
  // A bare loop asks for neither stamps nor drop counts.
  const int off = 0;
  setsockopt(bare.native_handle(), SOL_SOCKET, SO_TIMESTAMPNS, &off, sizeof off);
  setsockopt(bare.native_handle(), SOL_SOCKET, SO_RXQ_OVFL, &off, sizeof off);
  to_bare.learn_peer(bare);
  to_driver.learn_peer(driver);
  Session session{StreamSettings{}};
  session.start(clock.now());
  session.advance(session.deadline());
  std::vector<StampedRecord> out;
  out.reserve(kDatagrams * kMaxRecords);
  double bare_seconds = 0, driver_seconds = 0;
  std::uint64_t bare_records = 0, driver_records = 0;
  for (auto _ : state) {
    to_bare.burst(per_datagram);
    bare_seconds += bare_loop(bare, bare_records);
    to_driver.burst(per_datagram);
    driver_seconds += driver_loop(driver, clock, session, out);
    driver_records += out.size();
  }
  if (bare_records != driver_records) state.SkipWithError("records were lost");
  const double bare_ns = 1e9 * bare_seconds / static_cast<double>(bare_records);
  const double driver_ns = 1e9 * driver_seconds / static_cast<double>(driver_records);
  state.counters["bare_ns"] = bare_ns;
  state.counters["driver_ns"] = driver_ns;
  state.counters["ratio"] = driver_ns / bare_ns;
}
BENCHMARK(receive)->Arg(1)->Arg(40);

}  // namespace
