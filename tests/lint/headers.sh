#!/bin/bash
# Public headers include each other, and no more of JSON than its forward declarations: what programs
# compile is what is installed, and it compiles quickly. Usage: headers.sh REPOSITORY
set -euo pipefail
cd "$1"
allowed='#include ("qjulia/[a-z_]+\.hpp"|<nlohmann/json_fwd\.hpp>|<[a-zA-Z/_]+>)'
if grep -rn '#include' include | grep -vE ":$allowed"; then
  echo "^ public headers include \"qjulia/….hpp\", and <nlohmann/json_fwd.hpp> of JSON"
  exit 1
fi
echo "nothing else included in $(find include -name '*.hpp' | wc -l) public headers"
