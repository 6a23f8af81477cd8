// A load cell on a fake box of its own.
#pragma once

#include <optional>

#include "drivers/netbox/receive/load_cell.hpp"
#include "test/drivers/netbox/fake_box.hpp"
#include "test/soon.hpp"

namespace kphi::netbox::test {

using kphi::test::soon;

/// Box and page; the driver comes when it is asked for.
struct BenchBox {
  explicit BenchBox(const FakeBox::Manner& manner = {})
      : BenchBox(manner, FakeWeb::page(streaming_xml(manner.records_per_datagram))) {}
  BenchBox(const FakeBox::Manner& manner, const FakeWeb::Manner& page)
      : web(page), box(manner), clock(manner.speed), address{"127.0.0.1", box.port(), web->port()} {}

  std::optional<FakeWeb> web;
  FakeBox box;
  const SteadyClock clock;
  const Address address;
};

struct Bench : BenchBox {
  using BenchBox::BenchBox;
  LoadCell cell{address, clock};
};

}  // namespace kphi::netbox::test
