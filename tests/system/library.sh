#!/bin/bash
# Installs the build, then builds and runs the program and project of docs/library.md against it.
# Usage: library.sh REPOSITORY BUILD_FOLDER WORK_FOLDER COMPILER FLAGS
set -euo pipefail
repository=$1 build=$2 work=$3 compiler=$4 flags=$5

rm -rf "$work"
mkdir -p "$work"/{project,results,pocl_cache}
cmake --install "$build" --prefix "$work/prefix" >"$work/install.log"
"$work/prefix/bin/qjulia" --version

# block LANGUAGE NUMBER: the NUMBER-th block of a language, without its fences.
block() {
  awk -v fence="\`\`\`$1" -v wanted="$2" '
    /^```$/ { inside = 0 }
    inside && found == wanted
    $0 == fence { inside = 1; ++found }' "$repository/docs/library.md"
}
block cpp 1 >"$work/project/main.cpp"
block cmake 1 >"$work/project/CMakeLists.txt"
cmake -S "$work/project" -B "$work/build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags"
cmake --build "$work/build"

# The field of a map alone, which needs neither OpenMesh nor Expat nor PNG nor cairo.
mkdir -p "$work/field"
block cpp 2 >"$work/field/main.cpp"
cat >"$work/field/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.25)
project(field LANGUAGES CXX)
find_package(qjulia REQUIRED COMPONENTS field)
add_executable(field main.cpp)
target_compile_features(field PRIVATE cxx_std_20)
target_link_libraries(field PRIVATE qjulia::field)
END
cmake -S "$work/field" -B "$work/field_build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags"
cmake --build "$work/field_build"
"$work/field_build/field" "$repository/docs/maps/bunny.qjulia.json" | tee "$work/field_at_origin"
test "$(grep -c 'inside: 1' "$work/field_at_origin")" = 2  # the box's centre and the origin are inside
if ldd "$work/field_build/field" | grep -iE 'openmesh|cairo|expat|png'; then
  echo "^ the field of a map needs these"
  exit 1
fi

# An energy, minimised.
mkdir -p "$work/energy"
block cpp 3 >"$work/energy/main.cpp"
cp "$work/project/CMakeLists.txt" "$work/energy"
cmake -S "$work/energy" -B "$work/energy_build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags"
cmake --build "$work/energy_build"
"$work/energy_build/mine" | tee "$work/energies"
awk '/^energy [0-9]/ { if (!first) first = $2; last = $2 } END { exit !(last < first / 5) }' "$work/energies"

# The same with the shared libraries, which need no more to be found than Eigen and JSON, and with
# pkg-config.
mkdir -p "$work/shared"
sed 's/COMPONENTS field/COMPONENTS shared/; s/qjulia::field/qjulia::field_shared/' \
  "$work/field/CMakeLists.txt" >"$work/shared/CMakeLists.txt"
cp "$work/field/main.cpp" "$work/shared"
cmake -S "$work/shared" -B "$work/shared_build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags"
cmake --build "$work/shared_build"
libraries=$(dirname "$(find "$work/prefix" -name libqjulia_field.so.0)")
export PKG_CONFIG_PATH=$libraries/pkgconfig
"$compiler" -std=c++20 $flags "$work/shared/main.cpp" \
  $(pkg-config --cflags --libs qjulia-field) -o "$work/configured"
# Without -q: grep would end before pkg-config or ldd has written all, which pipefail takes for a failure.
pkg-config --static --libs qjulia | grep -e '-lOpenMeshCore' | grep -e -lOpenCL | grep -e -lcairo >/dev/null
for program in "$work/shared_build/field" "$work/configured"; do
  ldd "$program" | grep 'libqjulia_field\.so\.0 ' >/dev/null
  LD_LIBRARY_PATH=$libraries "$program" "$repository/docs/maps/bunny.qjulia.json" | cmp - "$work/field_at_origin"
done

# A component that there is not is named.
mkdir -p "$work/none"
sed 's/COMPONENTS shared/COMPONENTS nonsense/' "$work/shared/CMakeLists.txt" >"$work/none/CMakeLists.txt"
touch "$work/none/main.cpp"
cmake -S "$work/none" -B "$work/none_build" -DCMAKE_PREFIX_PATH="$work/prefix" \
  -DCMAKE_CXX_COMPILER="$compiler" >"$work/none.log" 2>&1 && exit 1
grep -q "no component 'nonsense'" "$work/none.log"

"$work/build/mine" "$repository/tests/data/wedge.obj" "$work/results" | tee "$work/figures"
grep -q '^n = 6: IoU 0\.[5-9]' "$work/figures"
for file in shape.qjulia.json shape.ply shape.png; do test -s "$work/results/$file"; done
