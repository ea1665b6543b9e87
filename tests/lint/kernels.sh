#!/bin/bash
# Every kernel is OpenCL C 1.2 without a warning, at each lane width and precision, to a compiler
# that is not the driver's own. Usage: kernels.sh REPOSITORY
set -euo pipefail
cd "$1"
checked=0
failed=0

# check KERNEL DEFINES…
check() {
  if ! clang -x cl -cl-std=CL1.2 -fsyntax-only -Wall -Wextra -Werror \
    -Xclang -finclude-default-header -Ikernels -Iinclude "${@:2}" "$1"; then
    echo "^ $1 with ${*:2}"
    failed=1
  fi
  checked=$((checked + 1))
}

for kernel in kernels/*.cl; do
  for width in 1 8 16; do
    for double in 0 1; do
      defines="-DQJ_WIDTH=$width -DQJ_DOUBLE=$double"
      check "$kernel" $defines
      if grep -q factor_sums.clh "$kernel"; then check "$kernel" $defines -DQJ_GROUP=64; fi
    done
  done
done
echo "$checked compilations"
exit $failed
