#!/bin/bash
# What stands on the library includes its public headers, as programs of others do: examples these alone, by
# <qjulia/….hpp>, and map.clh in kernels; python/ these and its own; tools/ also those of the rooms base and canvas.
# Usage: includes.sh REPOSITORY
set -euo pipefail
cd "$1"
includes() { grep -rnE '^ *# *include' --include='*.cpp' --include='*.hpp' "$@"; }
none() {  # none RULE: fails where there is a line, after showing it
  if cat | grep .; then
    echo "^ $1"
    exit 1
  fi
}
includes examples | { grep -vE '# *include (<[a-zA-Z0-9_/.]+>|"map\.clh")$' || true; } |
  none "examples include headers that are installed, in angle brackets"
for header in $(includes examples | grep -oE '<qjulia/[^>]*>' | tr -d '<>' | sort -u); do
  [[ -f include/$header ]] || echo "examples include <$header>"
done | none "there is no such public header"

rooms=$(ls -d host/*/ | cut -d/ -f2 | paste -sd'|')
private() { grep -E "# *include [\"<]($1|layout)/" || true; }
includes examples python | private "$rooms" | none "the public headers alone may be included here"
includes tools | private "$(tr '|' '\n' <<<"$rooms" | grep -vxE 'base|canvas' | paste -sd'|')" |
  none "tools/ may include public headers and those of base and canvas"
echo "$(includes examples python tools | wc -l) lines include nothing private"
