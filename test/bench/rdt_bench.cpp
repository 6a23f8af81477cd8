// What the judgement about a record costs, without any socket: decoding alone, and the whole session, against swapping
// the bytes of its nine words one by one. Interleaved; each line the median of many pairs.
#include <boost/endian/conversion.hpp>

#include "drivers/netbox/stream/session.hpp"
#include "test/bench/figures.hpp"
#include "test/drivers/netbox/receivers.hpp"

namespace {

using namespace kphi;
using namespace kphi::netbox;
using test::Bytes;

constexpr unsigned kRecords = 40'000, kPairs = 31;

/// Keeps the compiler from leaving out what fills `config`.
void use(const void* config) { asm volatile("" : : "r"(config) : "memory"); }

template <class Work>
double seconds_of(Work&& work) {
  const double begun = test::cpu_seconds();
  work();
  return test::cpu_seconds() - begun;
}

void swap_words(const std::vector<Bytes>& datagrams) {
  static std::array<std::uint32_t, 9 * kMaxRecords> words;
  for (const Bytes& datagram : datagrams) {
    for (std::size_t w = 0; w < datagram.size() / 4; ++w) words[w] = boost::endian::load_big_u32(&datagram[4 * w]);
    use(words.data());
  }
}

void decode_all(const std::vector<Bytes>& datagrams) {
  static std::array<LoadCellRecord, kMaxRecords> out;
  for (const Bytes& datagram : datagrams) {
    if (decode(datagram, out) == 0) return;
    use(out.data());
  }
}

void receive_all(const std::vector<Bytes>& datagrams) {
  static std::vector<LoadCellRecord> out;
  Session session{StreamSettings{}};
  session.start(Instant{0});
  session.advance(session.deadline());
  for (const Bytes& datagram : datagrams) {
    out.clear();
    session.receive(datagram, Instant{1}, out);
    use(out.data());
  }
}

void compare(const char* what, unsigned per_datagram, void (*work)(const std::vector<Bytes>&)) {
  std::vector<Bytes> datagrams;
  for (std::uint32_t i = 1; i <= kRecords; i += per_datagram) datagrams.push_back(test::records(i, i, per_datagram));
  std::vector<double> ratios, ns;
  for (unsigned pair = 0; pair < kPairs; ++pair) {
    const double bare = seconds_of([&] { swap_words(datagrams); }), driver = seconds_of([&] { work(datagrams); });
    ratios.push_back(driver / bare);
    ns.push_back(1e9 * driver / kRecords);
  }
  fmt::print("{}, {} per datagram: {:.1f} ns per record; worst pair {:.2f}\n", what, per_datagram, test::median(ns),
             *std::max_element(ratios.begin(), ratios.end()));
  bench::compared(test::median(ratios), fmt::format("{}, {} per datagram / swapping words", what, per_datagram));
}

}  // namespace

int main() {
  for (const unsigned per_datagram : {1u, 40u}) {
    compare("decode", per_datagram, decode_all);
    compare("session", per_datagram, receive_all);
  }
}
