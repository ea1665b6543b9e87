#!/bin/bash
# Public headers include each other, and no more of JSON than its forward declarations: what programs
# compile is what is installed, and it compiles quickly. They need Eigen, JSON and the standard library
# alone; opencl.hpp alone has OpenCL's, and qjulia.hpp leaves it out. With `alone`, which takes minutes, each
# is also compiled by itself.
# Usage: headers.sh REPOSITORY BUILD_FOLDER COMPILER [alone]
set -euo pipefail
cd "$1"
compiler=$3
allowed='#include ("qjulia/[a-z_/]+\.hpp"|<nlohmann/json_fwd\.hpp>|<[a-zA-Z/_]+>)'
if grep -rnE '^ *#include' include | grep -vE ":$allowed" |
  grep -vE '^include/qjulia/map/opencl\.hpp:[0-9]+:#include <CL/cl\.h>$'; then
  echo "^ public headers include \"qjulia/….hpp\", <nlohmann/json_fwd.hpp> of JSON, and opencl.hpp <CL/cl.h>"
  exit 1
fi

eigen=$(pkg-config --cflags eigen3)
read_by_all=$(echo '#include "qjulia/qjulia.hpp"' | $compiler -std=c++20 -Iinclude $eigen -M -x c++ -)
if grep -oiE '[^ ]*(OpenMesh|cairo|expat|httplib|nanoflann|png|CL/)[^ ]*' <<<"$read_by_all"; then
  echo "^ public headers need these"
  exit 1
fi

if [[ ${4:-} != alone ]]; then
  echo "nothing else is read by $(find include -name '*.hpp' | wc -l) public headers"
  exit
fi
compile_alone() {
  echo "#include \"${1#include/}\"" |
    $compiler -std=c++20 -Iinclude $eigen -fsyntax-only -x c++ - ||
    { echo "$1 does not compile alone"; return 1; }
}
export -f compile_alone
export compiler eigen
find include -name '*.hpp' | sort | xargs -P "$(nproc)" -I{} bash -c 'compile_alone {}'
echo "$(find include -name '*.hpp' | wc -l) public headers compile alone"
