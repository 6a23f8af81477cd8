#!/bin/sh
# Debian packages for arm64, built by Debian 12's cross compiler in a Debian of its own (build/debian-arm64, which stays for the
# next time), so that this computer's packages are left as they are. As root, in a mount namespace of its own:
# unshare --mount cross.sh [try] -- PACKAGES that the build needs. try: also run tests, and a campaign, under qemu-user.
set -eu
try=
[ "$1" != try ] || { try=yes; shift; }
[ "$1" != -- ] || shift
source=$PWD debian=$PWD/build/debian-arm64
. "$(dirname "$0")/fresh_debian.sh"
say() { printf '\n== %s\n' "$*" >&2; }

mkdir -p "$source/build"
if [ ! -e "$debian.ready" ]; then
  say "installing a Debian 12 into $debian"
  rm -rf --one-file-system "$debian"
  make_debian "$debian"
  touch "$debian.ready"
fi
enter_debian "$debian"
export DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8
say "installing the cross compiler and what kphi is built with, for arm64"
inside 'dpkg --add-architecture arm64; apt-get update -q >/dev/null'
# Headers and libraries of arm64; what is the same for all architectures, and all programs, of this one.
wanted=
for package; do
  case "$package" in
    python3-dev) wanted="$wanted python3 libpython3-dev:arm64 libpython3.11-stdlib:arm64" ;;
    *-dev)
      if inside "apt-cache show --no-all-versions $package" | grep -q '^Architecture: all$'; then
        wanted="$wanted $package"
      else
        wanted="$wanted $package:arm64"
      fi ;;
    *) wanted="$wanted $package" ;;
  esac
done
inside "apt-get install -y -q --no-install-recommends $wanted >/dev/null"

mkdir -p "$debian$source" "$debian/ccache"
mount --bind "$source" "$debian$source"
cache=$(ccache --get-config cache_dir 2>/dev/null) && [ -d "$cache" ] && mount --bind "$cache" "$debian/ccache"
export CCACHE_DIR=/ccache
in_source() { inside "cd '$source'; $1"; }
build=build/package-arm64
say "building the packages"
in_source "cmake --preset package-arm64 --log-level=WARNING && cmake --build $build
  export DEB_HOST_ARCH=arm64; cd $build && cpack --config CPackConfig.cmake" >&2
[ -n "$try" ] || exit 0

say "testing under qemu-user what reads bytes, reduces and fits"
in_source "cmake --preset package-arm64 -DKPHI_PACKAGE=OFF --log-level=WARNING
  cmake --build $build --target kphi_drivers_test kphi_results_test kphi_reduction_test kphi_fit_test" >&2
# All suites of results and its reduction; of the Net Box those without a network, of fit those without a report.
for tests in 'kphi_drivers_test Rdt*:Status.*:Gathering.*:RecordQueue.*:Reorder*:Sequence.*:ClockEstimate.*:Calinfo*:Configuration.*:Filter.*' \
  'kphi_reduction_test *' 'kphi_results_test *' \
  'kphi_fit_test Air.*:AveragedRuns.*:C*Fit*:Coefficient*:D*:Identification.*:Line*:Nist*:Outlying*:Power.*:Robust*:Step*:TableFit.*:ThrustFit.*'; do
  in_source "qemu-aarch64-static \$(find $build/test -name ${tests%% *} -type f) --gtest_brief=1 '--gtest_filter=${tests#* }'" >&2
done

say "a campaign on the deterministic bench: arm64 beside $(dpkg --print-architecture)"
work=$source/$build/campaign
rm -rf "$work"
mkdir -p "$work/here" "$work/arm64"
cat >"$work/bench.yaml" <<'BENCH'
format: kphi-bench/1
name: deterministic
netbox: {host: 127.0.0.1, rdt_port: 49152, http_port: 8049, rate_hz: 7000, records_per_datagram: 40}
iq: {device: /dev/null, baud: 921600, module_id: 0, spin: +1, telemetry_hz: 50, speed_max_rpm: 19300}
thrust_axis: "+Fz"
simulation: {in_process: true, seed: 5}
BENCH
cat >"$work/campaign.yaml" <<'CAMPAIGN'
format: kphi-campaign/1
name: short
propeller: {id: 5x3, name: 5-inch three-blade, diameter_in: 5, blades: 3}
occlusions_deg: [0, 90, 180]
repetitions: 2
repetitions_extra_max: 0
profile: {steps: 4, dwell_s: 0.6, first_rpm: 6000, last_rpm: 18000, slew_rpm_s: 8000}
zero_s: 0.5
minimum_discard_s: 0.2
supply_v: 12.0
limits: {speed_max_rpm: 19100, thrust_max_n: 20, supply_current_max_a: 35, coil_temperature_max_degc: 110}
CAMPAIGN
commands="run ../campaign.yaml --bench ../bench.yaml --out . --yes"
(cd "$work/here" && "$source/build/release/kphi" $commands 2>log && "$source/build/release/kphi" fit --accept */ >fitted 2>>log)
in_source "cd '$work/arm64'; kphi='qemu-aarch64-static ../../kphi'; \$kphi $commands 2>log; \$kphi fit --accept */ >fitted 2>>log"
# Numbers apart from the rest; how many are equal to the last digit, and how far the others are apart at most.
for table in steps.csv means.csv coefficients.yaml; do
  awk -v table="$table" '
    { n = split($0, words, /[ ,:{}\[\]"]+/); for (i = 1; i <= n; i++) if (FNR == NR) first[FNR, i] = words[i]; else judge(first[FNR, i], words[i]) }
    function judge(a, b) {
      if (a "" == b "") { equal += a ~ /^[-+]?[0-9]/; return }
      if (a !~ /^[-+]?[0-9.]+(e[-+]?[0-9]+)?$/) { texts = texts " " b; return }
      others++; apart = a - b; size = (a < 0 ? -a : a); if (apart < 0) apart = -apart
      if (size > 0 && apart / size > most) { most = apart / size; which = a " and " b }
    }
    END { printf "%s: %d numbers equal, %d not, by %.2g of themselves at most%s%s\n", table, equal, others, most,
                 which == "" ? "" : " (" which ")", texts == "" ? "" : "; other words:" texts }' "$work"/here/*/"$table" "$work"/arm64/*/"$table"
done
