#!/bin/bash
# Every kernel is OpenCL C 1.2 without a warning, at each lane width and precision, to a compiler
# that is not the driver's own. Usage: kernels.sh REPOSITORY
set -euo pipefail
cd "$1"
checked=0
failed=0
for kernel in kernels/*.cl; do
  for width in 1 8 16; do
    for double in 0 1; do
      if ! clang -x cl -cl-std=CL1.2 -fsyntax-only -Wall -Wextra -Werror \
        -Xclang -finclude-default-header -Ikernels -Iinclude \
        -DQJ_WIDTH=$width -DQJ_DOUBLE=$double "$kernel"; then
        echo "^ $kernel with -DQJ_WIDTH=$width -DQJ_DOUBLE=$double"
        failed=1
      fi
      checked=$((checked + 1))
    done
  done
done
echo "$checked compilations"
exit $failed
