# Sourced by what needs a Debian 12 of its own and leaves this computer as it is; as root.
# shellcheck shell=sh

# make_debian FOLDER [MIRROR]: installs the smallest Debian 12 into a folder, from this computer's own mirror if none is named.
make_debian() {
  mirror=${2:-$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' 'Component: main' | head -1)}
  # shellcheck disable=SC2086
  debootstrap --variant=minbase bookworm "$1" $mirror >"$1.log" 2>&1 || { tail "$1.log" >&2; return 1; }
  rm -f "$1.log"
  for list in /etc/apt/sources.list /etc/apt/sources.list.d /etc/apt/apt.conf.d /etc/apt/auth.conf.d /etc/ssl/certs; do
    if [ -e "$list" ]; then rm -rf "${1:?}$list"; cp -rLf "$list" "$1$(dirname "$list")/" 2>/dev/null || true; fi
  done
  [ -e /etc/apt/sources.list ] || rm -f "$1/etc/apt/sources.list"
}

# enter_debian FOLDER: what `inside COMMAND` needs to run in it; leave_debian FOLDER before it is removed.
enter_debian() {
  root=$1
  mount -t proc proc "$root/proc"
  mount --rbind /dev "$root/dev"
  mount --make-rslave "$root/dev"
  cp -f /etc/resolv.conf "$root/etc/resolv.conf" 2>/dev/null || true
}
leave_debian() {
  umount "$1/proc" 2>/dev/null || true
  umount -R "$1/dev" 2>/dev/null || true
}
inside() { chroot "$root" /bin/sh -ec "$1"; }
