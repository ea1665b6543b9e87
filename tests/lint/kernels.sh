#!/bin/bash
# Every kernel is OpenCL C 1.2 without a warning, by itself with no option at all, and with all others
# at each lane width and precision, to a compiler that is not the driver's own. Every helper is static
# inline: a plain inline function has no body of its own in C99, and programs that call it may not link.
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

for kernel in kernels/*.cl; do check "$kernel"; done

# all KERNEL…: a source of all of these, in $source, so that headers are read once a compilation.
source=$(mktemp --suffix=.cl)
trap 'rm -f "$source"' EXIT
all() { printf '#include "%s"\n' "${@##*/}" >"$source"; }

# Gradients know factors alone.
mapfile -t of_any_map < <(grep -l '"map.clh"' kernels/*.cl | xargs grep -L factor_sums.clh)
for width in 1 8 16; do
  for double in 0 1; do
    defines="-DQJ_WIDTH=$width -DQJ_DOUBLE=$double"
    all kernels/*.cl
    check "$source" $defines
    check "$source" $defines -DQJ_GROUP=64
    check "$source" $defines -DQJ_LINEAR_LOSS=1
    all "${of_any_map[@]}"
    for file in kernels/*_modulus.clh; do check "$source" $defines "-DQJ_MODULUS=\"${file##*/}\""; done
    for file in kernels/*_versor.clh; do check "$source" $defines "-DQJ_VERSOR=\"${file##*/}\""; done
    check "$source" $defines '-DQJ_PORTALS="portals.clh"'
    check "$source" $defines '-DQJ_PAINT="painted.clh"'
  done
done
echo "$checked compilations"
exit $failed
