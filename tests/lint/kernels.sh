#!/bin/bash
# Every kernel is OpenCL C 1.2 without a warning, at each lane width and precision, and by itself with
# no option at all, to a compiler that is not the driver's own. Every helper is static inline: a
# plain inline function has no body of its own in C99, and programs that call it may not link.
# Usage: kernels.sh REPOSITORY
set -euo pipefail
cd "$1"
checked=0
failed=0

# check KERNEL DEFINES…
check() {
  if ! clang -x cl -cl-std=CL1.2 -fsyntax-only -Wall -Wextra -Werror \
    -Xclang -finclude-default-header -Ikernels "${@:2}" "$1"; then
    echo "^ $1 with ${*:2}"
    failed=1
  fi
  checked=$((checked + 1))
}

if grep -nE '^[a-z].*\(' kernels/*.cl kernels/*.clh kernels/layout/*.h |
  grep -vE '^[^:]*:[0-9]+:(static inline|factor_loop|inlined_on_gpus|kernel void|typedef|for|if|SUMS_KERNEL kernel void) '; then
  echo '^ not static inline'
  failed=1
fi

for kernel in kernels/*.cl; do
  check "$kernel"
  for width in 1 8 16; do
    for double in 0 1; do
      defines="-DQJ_WIDTH=$width -DQJ_DOUBLE=$double"
      check "$kernel" $defines
      # Gradients know factors alone.
      if grep -q '"map.clh"' "$kernel" && ! grep -q factor_sums.clh "$kernel"; then
        for file in kernels/*_modulus.clh; do check "$kernel" $defines "-DQJ_MODULUS=\"${file##*/}\""; done
        for file in kernels/*_versor.clh; do check "$kernel" $defines "-DQJ_VERSOR=\"${file##*/}\""; done
        check "$kernel" $defines '-DQJ_PORTALS="portals.clh"'
        check "$kernel" $defines '-DQJ_PAINT="painted.clh"'
      fi
      if grep -q factor_sums.clh "$kernel"; then check "$kernel" $defines -DQJ_GROUP=64; fi
    done
  done
done
echo "$checked compilations"
exit $failed
