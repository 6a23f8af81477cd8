# Compares counted instructions with the held ones and exits with 1 if one differs too much. Three files in this order:
# the paths as the program prints them (name, units, unit), the dumps of callgrind, counts.txt.
BEGIN { allowed = 2 }  # percent

FNR == 1 { ++file }
file == 1 { order[++paths] = $1; units[$1] = $2; unit[$1] = $3 }
file == 2 && /^desc: Trigger: Client Request: / { name = $NF }
file == 2 && /^totals: / && name != "" { counted[name] = $2; name = "" }
file == 3 && !/^#/ && $2 > 0 { held[$1] = $2 }

function complain(text) { complaints[++failures] = text }

function compare(name) {
  each = sprintf("%10.1f per %s", counted[name] / units[name], unit[name])
  if (!(name in held)) {
    printf "%-12s %12d %12s %13s %s\n", name, counted[name], "-", "-", each
    return complain(name ": not in counts.txt: ./run counts accept")
  }
  difference = 100 * (counted[name] / held[name] - 1)
  printf "%-12s %12d %12d %+11.2f %% %s\n", name, counted[name], held[name], difference, each
  if (difference > allowed)
    complain(sprintf("%s: %.1f %% dearer, %d %% allowed; find the cause, or ./run counts accept", name, difference,
                     allowed))
  if (difference < -allowed)
    complain(sprintf("%s: %.1f %% cheaper: ./run counts accept", name, -difference))
}

END {
  printf "%-12s %12s %12s %13s\n", "path", "counted", "held", "difference"
  for (i = 1; i <= paths; ++i)
    if (order[i] in counted) compare(order[i])
    else complain(order[i] ": not counted: callgrind wrote no dump of it")
  for (name in held)
    if (!(name in units)) complain(name ": in counts.txt, but not counted: ./run counts accept")
  for (i = 1; i <= failures; ++i) print "run: " complaints[i] > "/dev/stderr"
  exit failures > 0
}
