#!/bin/bash
# Builds examples/cpp against an installed package, from where that has put them, and runs each at a small size.
# Usage: cpp_examples.sh REPOSITORY PREFIX WORK_FOLDER COMPILER PYTHON3 FLAGS
set -euo pipefail
repository=$1 prefix=$2 work=$3 compiler=$4 python3=$5 flags=$6

rm -rf "$work"
mkdir -p "$work"/results
examples=$prefix/share/doc/qjulia/examples
diff -r "$repository/examples/cpp" "$examples/cpp"
diff -r -x __pycache__ "$repository/examples/python" "$examples/python"
cmake -S "$examples/cpp" -B "$work/build" -G Ninja -DCMAKE_BUILD_TYPE=Debug \
  -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags -Wall -Wextra -Werror"
cmake --build "$work/build"
for source in "$repository"/examples/cpp/*.cpp; do
  grep -q "^run $(basename "$source" .cpp) " "$0" || { echo "$source is not run here"; exit 1; }
done

cd "$work/results"
run() {
  echo "$*"
  "$work/build/$1" "${@:2}" | tee said
}
number_after() { grep -oE -e "$1[0-9.e-]+" said | tail -n 1 | sed "s/^$1//"; }
is() { awk "BEGIN { exit !($1) }" || { echo "not so: $1"; exit 1; }; }

cp "$repository/tests/data/wedge.obj" .
cp "$repository/tests/data/icosahedron.obj" ball.obj

run fit_and_draw wedge.obj 8 fast 80
is "$(number_after 'shape.ply with ') > 100"
test -s shape.qjulia.json

run own_optimiser wedge.obj 24 3000 60
is "$(number_after 'IoU ') > 0.7"
is "$(number_after '-> ') < -0.75"
test -s own.qjulia.json

run knobs wedge.obj 2 16
test "$(wc -l <said)" = 7
awk -F, 'NR > 1 && !($3 > 0.1 && $3 < 10) { exit 1 }' said

run all_devices 8 fast wedge.obj ball.obj
test "$(grep -cE 'IoU 0\.[5-9]' said)" = 2
test -s wedge.qjulia.json -a -s ball.qjulia.json
! "$work/build/all_devices" 8 fast none.obj >said
grep -q none.obj said

run own_kernel "$repository/docs/maps/quadratic.qjulia.json" 64
run morph wedge.obj ball.obj 8 fast 2 32
"$python3" - "$repository/docs/maps/quadratic.qjulia.json" <<END
import json, sys
import numpy as np
from PIL import Image
# The kernel's picture, computed here anew: of q^2 + c, as far from X = 0 as each orbit comes.
map = json.load(open(sys.argv[1]))
c = np.array(map["c"])
side = (np.arange(64) + 0.5) / 64 * 4 - 2
x, y = np.meshgrid(side, -side)
q = np.stack([x, y, 0 * x, 0 * x + map["slice"]], axis=-1)
live, least = np.ones(x.shape, bool), np.ones(x.shape)
for _ in range(8):
    v = q[..., 1:]
    next = np.concatenate([(q[..., :1] ** 2 - (v**2).sum(-1, keepdims=True)), 2 * q[..., :1] * v], -1) + c
    live = live & (np.linalg.norm(next, axis=-1) < 20)
    q = np.where(live[..., None], next, q)
    least = np.where(live, np.minimum(least, abs(q[..., 0])), least)
drawn = np.asarray(Image.open("traps.png").convert("L"), float)
off = abs(drawn - np.floor(255 * np.sqrt(least))) > 2
assert drawn.std() > 20 and off.mean() < 0.02, (drawn.std(), off.mean())

morph = np.asarray(Image.open("morph.png").convert("L"), float)
assert morph.shape == (32, 64), morph.shape
assert abs(morph[:, :32] - morph[:, 32:]).mean() > 3
assert min(np.asarray(Image.open("shape.png")).shape[:2]) == 60
END
