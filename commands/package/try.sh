#!/bin/sh
# The first hour of a stranger: a fresh Debian, the packages installed, a campaign on the simulated bench as an ordinary
# user in dialout, the library found by a compiler, and nothing left after a purge. As root: FOLDER_OF_PACKAGES [MIRROR]
set -eu
packages=$(readlink -f "$1") mirror=${2:-}
. "$(dirname "$0")/fresh_debian.sh"
root=$(mktemp -d /var/tmp/kphi-try.XXXXXX)
chmod 755 "$root"
trap 'leave_debian "$root"; rm -rf --one-file-system "$root"' EXIT
make_debian "$root" "$mirror"
enter_debian "$root"
inside 'apt-get update -q >/dev/null'
# What was there before, to find what a purge leaves.
listing() { (cd "$root" && find etc usr var/lib -xdev -path 'usr/share/man' -prune -o -name '*kphi*' -print | sort); }
before=$(listing)
mkdir -p "$root/packages"
cp "$packages"/*.deb "$root/packages/"
inside 'DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends /packages/kphi_*.deb >/dev/null'
inside 'useradd -m -G dialout stranger'
cat >"$root/home/stranger/first.sh" <<'FIRST'
set -e
cd "$(mktemp -d)"
kphi --version
kphi init
kphi check campaign.yaml bench.yaml
kphi sim bench.yaml >sim.log 2>&1 &
sim=$!
trap 'kill $sim' EXIT
until kphi sim bench.yaml --status >/dev/null 2>&1; do sleep 0.2; done
kphi devices --bench bench.yaml | head -3
kphi run campaign.yaml --bench bench.yaml --yes >folder 2>run.log || { tail run.log; exit 1; }
kphi fit "$(cat folder)"
kphi list
grep -c '<svg' "$(cat folder)/report.html"
kphi init vehicle
kphi fly --coefficients "$(cat folder)/coefficients.yaml" --vehicle vehicle.yaml | head -2
FIRST
inside 'su - stranger -c "sh first.sh"'
inside 'DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends /packages/libkphi-compensation-dev_*.deb g++ pkg-config >/dev/null
  printf "#include \"compensation/compensator.hpp\"\nint main() { return kphi::compensation::doubts_about(*kphi::compensation::ThrustCurve::from_line(kphi::ThrustCoefficient(1e-6), kphi::ThrustCoefficient(1e-6), -1e-7, kphi::Radians(4)), {}).gains_with_occlusion; }\n" >/tmp/t.cpp
  g++ -std=c++17 /tmp/t.cpp $(pkg-config --cflags --libs kphi_compensation) -o /tmp/t && /tmp/t && echo "library linked"'
inside 'DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends /packages/python3-kphi-compensation_*.deb >/dev/null
  python3 -c "import kphi_compensation as kphi; print(kphi.ThrustCurve.from_line(1e-6, 1e-6, -1e-7, 4), \"in Python\")"'
inside 'apt-get purge -y -q kphi libkphi-compensation-dev python3-kphi-compensation >/dev/null'
after=$(listing)
[ "$before" = "$after" ] || { echo "left after the purge:"; echo "$after"; exit 1; }
echo "purged: nothing left"
