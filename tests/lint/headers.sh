#!/bin/bash
# Public headers include each other, and no more of JSON than its forward declarations: what programs
# compile is what is installed, and it compiles quickly. Each compiles alone, from Eigen, JSON and the
# standard library. Usage: headers.sh REPOSITORY BUILD_FOLDER COMPILER
set -euo pipefail
cd "$1"
compiler=$3
allowed='#include ("qjulia/[a-z_]+\.hpp"|<nlohmann/json_fwd\.hpp>|<[a-zA-Z/_]+>)'
if grep -rn '#include' include | grep -vE ":$allowed"; then
  echo "^ public headers include \"qjulia/….hpp\", and <nlohmann/json_fwd.hpp> of JSON"
  exit 1
fi

eigen=$(pkg-config --cflags eigen3)
compile_alone() {
  local header=${1#include/} read
  read=$(echo "#include \"$header\"" |
    $compiler -std=c++20 -Iinclude $eigen -fsyntax-only -M -MG -x c++ - 2>/dev/null) &&
    echo "#include \"$header\"" | $compiler -std=c++20 -Iinclude $eigen -fsyntax-only -x c++ - ||
    { echo "$header does not compile alone"; return 1; }
  if grep -oiE '[^ ]*(OpenMesh|cairo|httplib|png|CL/)[^ ]*' <<<"$read"; then
    echo "^ $header needs this"
    return 1
  fi
}
export -f compile_alone
export compiler eigen
find include -name '*.hpp' | sort | xargs -P "$(nproc)" -I{} bash -c 'compile_alone {}'
echo "$(find include -name '*.hpp' | wc -l) public headers compile alone"
