// Makes the drivers of this bench known by their words: hx711 and esc.
#pragma once

namespace kphi::second_bench {

/// Before a bench file is used.
void offer_drivers();

}  // namespace kphi::second_bench
