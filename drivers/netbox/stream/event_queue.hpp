// Events on their way from one thread to another.
#pragma once

#include <boost/lockfree/spsc_queue.hpp>

#include "drivers/netbox/stream/events.hpp"

namespace kphi::netbox {

using EventQueue = boost::lockfree::spsc_queue<Event, boost::lockfree::capacity<256>>;

}  // namespace kphi::netbox
