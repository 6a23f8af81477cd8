#!/bin/sh
# kphi.1, and kphi-VERB.1 of every verb, by what --help says. PROGRAM HELP2MAN FOLDER [EMULATOR of its processor]
set -eu
program=$1 help2man=$2 folder=$3
rm -rf "$folder"
mkdir -p "$folder"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ $# -gt 3 ]; then
  printf '#!/bin/sh\nexec %s "%s" "$@"\n' "$4" "$1" >"$work/kphi"
  chmod +x "$work/kphi"
  program=$work/kphi
fi
export LC_ALL=C.UTF-8
verbs=$("$program" completion bash | sed -n 's/.*words="\(init [^"]*\) help".*/\1/p')
page() { # name, command, what it is, see also
  printf '[see also]\n%s\n' "$4" >"$work/more"
  "$help2man" --no-info --locale=C.UTF-8 --section=1 --manual='User Commands' --source=kphi --include="$work/more" \
    --version-string="$("$program" --version)" --name="$3" --output="$work/page" "$2"
  # By the usage line help2man calls every page kphi.
  sed -e "s/^kphi \\\\- /$1 \\\\- /" -e "s/^\.TH KPHI /.TH $(echo "$1" | tr a-z A-Z) /" "$work/page" | gzip -9n >"$folder/$1.1.gz"
}
all=
for verb in $verbs; do
  printf '#!/bin/sh\nexec "%s" %s "$@"\n' "$program" "$verb" >"$work/kphi-$verb"
  chmod +x "$work/kphi-$verb"
  page "kphi-$verb" "$work/kphi-$verb" "$("$program" "$verb" --help | head -1)" '\fBkphi\fR(1)'
  all="$all${all:+, }\\fBkphi-$verb\\fR(1)"
done
page kphi "$program" 'propeller test stand: how much thrust an occlusion costs' "$all"
