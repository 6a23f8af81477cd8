#!/usr/bin/env bash
# What can be said of a change before it is built; `./run gate`. All complaints, not only the first.
# Of the commits it sees those that the checkout has.
set -euo pipefail
cd "$(dirname "$0")/../.."

code_folders=(base commands compensation daq drivers examples fit profiles results)
failed=0
complain() { printf 'gate: %s\n' "$*" >&2; failed=1; }

# test/house/budget.txt: how many lines that are not empty a folder's code may have.
# Not of a user's campaigns in results/, which git leaves out.
code_of() { git ls-files -z --cached --others --exclude-standard --deduplicate -- "$1/*."{?pp,[ch],'*js',css,html,py,sh,awk,cmake} "$1/**CMakeLists.txt"; }
lines_of() { code_of "$1" | xargs -0 ls -d 2>/dev/null | xargs -d '\n' cat | grep -c '[^[:space:]]'; }
budget_at() { git show "$1:test/house/budget.txt" 2>/dev/null | grep -v '^#' || true; }

look_at_format() {
  local found
  found=$(find "${code_folders[@]}" test \( -name '*.?pp' -o -name '*.[ch]' \) -print0 |
    xargs -0 -P "$(nproc)" -n 50 clang-format-14 --dry-run -Werror 2>&1) && return
  complain "not formatted, ./run format does it:"$'\n'"$(grep 'error:' <<<"$found" || echo "clang-format-14 failed: $found")"
}

look_at_readmes() {
  local folder
  while read -r folder; do
    [ -s "$folder/README.md" ] || complain "$folder has code and no README.md"
  done < <(find "${code_folders[@]}" \( -name '*.?pp' -o -name '*.[ch]' \) -printf '%h\n' | sort -u)
}

look_at_budget() {
  local folder allowed lines
  for folder in "${code_folders[@]}" test; do
    allowed=$(awk -v folder="$folder" '$1 == folder { print $2 }' test/house/budget.txt)
    lines=$(lines_of "$folder")
    [ "${allowed:-0}" -ge "$lines" ] ||
      complain "$folder has $lines lines of code, its budget is ${allowed:-not in test/house/budget.txt}: take some out, or raise it in a commit that says \"Budget: $folder: why\""
  done
  local commit raised
  for commit in $(git log --format=%H -- test/house/budget.txt 2>/dev/null); do
    [ -n "$(budget_at "$commit^")" ] || continue
    for raised in $(join <(budget_at "$commit^" | sort) <(budget_at "$commit" | sort) | awk '$3 > $2 { print $1 }'); do
      git log -1 --format=%B "$commit" | grep -q "^Budget: $raised: ." ||
        complain "commit ${commit:0:12} raises the budget of $raised, and no line of it says \"Budget: $raised: why\""
    done
  done
}

# Who uses kphi reads in the changelog what became different. A commit that changes code and nothing that anybody could
# notice says "Behaviour: unchanged"; the others come with the changelog, or before a commit that does.
look_at_changelog() {
  local last commit
  last=$(git log -1 --format=%H -- docs/CHANGELOG.md 2>/dev/null || true)
  [ -n "$last" ] || return 0
  for commit in $(git log --format=%H "$last..HEAD" -- "${code_folders[@]}"); do
    git show --format= --name-only "$commit" -- "${code_folders[@]}" | grep -qE '\.([ch]|.pp|js|css|html|yaml)$' || continue
    git log -1 --format=%B "$commit" | grep -qx 'Behaviour: unchanged' ||
      complain "commit ${commit:0:12} changes code; docs/CHANGELOG.md does not say what became different, nor the commit \"Behaviour: unchanged\""
  done
}

# What cannot be looked at has not passed.
case "$(git rev-parse --is-shallow-repository 2>/dev/null)" in
  false) ;;
  true) echo "gate: of the history only the last commits are here; what earlier ones say was not looked at" >&2 ;;
  *) complain "no history here: what commits say cannot be looked at" ;;
esac
look_at_format
look_at_readmes
look_at_budget
look_at_changelog
exit $failed
