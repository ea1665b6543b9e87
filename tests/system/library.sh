#!/bin/bash
# Installs the build, then builds and runs the program and project of docs/guide/library.md against it.
# Usage: library.sh REPOSITORY BUILD_FOLDER WORK_FOLDER COMPILER FLAGS
set -euo pipefail
repository=$1 build=$2 work=$3 compiler=$4 flags=$5

rm -rf "$work"
mkdir -p "$work"/{project,results}
cmake --install "$build" --prefix "$work/prefix" >"$work/install.log"
"$work/prefix/bin/qjulia" --version

# block LANGUAGE NUMBER: the NUMBER-th block of a language, without its fences.
block() {
  awk -v fence="\`\`\`$1" -v wanted="$2" '
    /^```$/ { inside = 0 }
    inside && found == wanted
    $0 == fence { inside = 1; ++found }' "$repository/docs/guide/library.md"
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
  -DCMAKE_DISABLE_FIND_PACKAGE_OpenMesh=ON -DCMAKE_DISABLE_FIND_PACKAGE_PNG=ON \
  -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags"
cmake --build "$work/field_build"
"$work/field_build/field" "$repository/docs/maps/bunny.qjulia.json" | tee "$work/field_at_origin"
test "$(grep -c 'inside: 1' "$work/field_at_origin")" = 2  # the box's centre and the origin are inside
if ldd "$work/field_build/field" | grep -iE 'openmesh|cairo|expat|png'; then
  echo "^ the field of a map needs these"
  exit 1
fi

# The other parts, each of which links to no more than it needs. The field and fits are configured where
# CMake does not find PNG, nor cairo, which pkg-config says where it is.
mkdir -p "$work/parts"
cat >"$work/parts/mesh.cpp" <<END
#include <qjulia/mesh/mesh.hpp>
int main() {
  const qjulia::TriangleMesh wedge = qjulia::read_mesh("$repository/tests/data/wedge.obj");
  return qjulia::inspect(wedge).closed() ? 0 : 1;
}
END
cat >"$work/parts/fit.cpp" <<END
#include <qjulia/fit/fit.hpp>
int main() {
  qjulia::FitOptions options;
  options.schedule_text = qjulia::schedule_text("fast");
  options.validate();
}
END
cat >"$work/parts/picture.cpp" <<END
#include <qjulia/base/colors.hpp>
#include <qjulia/picture/picture.hpp>
int main() {
  qjulia::Image picture;
  picture.width = picture.height = 1;
  picture.pixels = {255, 0, 0};
  qjulia::write_png(picture, "$work/parts/red.png");
}
END
cat >"$work/parts/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.25)
project(parts LANGUAGES CXX)
if(NOT COMPONENTS)
  set(COMPONENTS \${PARTS})
endif()
find_package(qjulia REQUIRED COMPONENTS \${COMPONENTS})
foreach(part IN LISTS PARTS)
  add_executable(\${part} \${part}.cpp)
  target_compile_features(\${part} PRIVATE cxx_std_20)
  target_link_libraries(\${part} PRIVATE qjulia::\${part}\${SHARED})
endforeach()
END
# configure_parts FOLDER OPTION...
configure_parts() {
  cmake -S "$work/parts" -B "$work/$1" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/prefix" \
    -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags" "${@:2}"
}
without_pictures=(-DCMAKE_DISABLE_FIND_PACKAGE_PNG=ON)  # PkgConfig is what finds Expat
configure_parts fit_build "-DPARTS=fit;mesh" "${without_pictures[@]}"
configure_parts picture_build -DPARTS=picture
configure_parts shared_parts "-DPARTS=fit;mesh;picture" -DSHARED=_shared -DCOMPONENTS=shared
for folder in fit_build picture_build shared_parts; do cmake --build "$work/$folder"; done
for program in fit_build/{fit,mesh} picture_build/picture shared_parts/{fit,mesh,picture}; do
  LD_LIBRARY_PATH=$(dirname "$(find "$work/prefix" -name libqjulia_field.so.0)") "$work/$program"
done
test -s "$work/parts/red.png"
for part in fit mesh; do
  if ldd "$work/fit_build/$part" | grep -iE 'cairo|png'; then
    echo "^ $part needs these"
    exit 1
  fi
done
ldd "$work/picture_build/picture" | grep cairo >/dev/null

# An energy, minimised.
mkdir -p "$work/energy"
block cpp 3 >"$work/energy/main.cpp"
cp "$work/project/CMakeLists.txt" "$work/energy"
cmake -S "$work/energy" -B "$work/energy_build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags"
cmake --build "$work/energy_build"
"$work/energy_build/mine" | tee "$work/energies"
awk '/^energy [0-9]/ { if (!first) first = $2; last = $2 } END { exit !(last < first / 5) }' "$work/energies"

# A fit, stage by stage.
mkdir -p "$work/fit"
block cpp 4 >"$work/fit/main.cpp"
sed 's/COMPONENTS field/COMPONENTS fit/; s/qjulia::field/qjulia::fit/' "$work/field/CMakeLists.txt" >"$work/fit/CMakeLists.txt"
cmake -S "$work/fit" -B "$work/fit_by_stages" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/prefix" \
  -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags" "${without_pictures[@]}"
cmake --build "$work/fit_by_stages"
"$work/fit_by_stages/field" "$repository/tests/data/wedge.obj" "$work/by_stages.qjulia.json" | tee "$work/stages"
grep -q '^ended: ' "$work/stages"
test "$(grep -c ': IoU 0\.[5-9]' "$work/stages")" -ge 1
test -s "$work/by_stages.qjulia.json"

# The same with the shared libraries, which need no more to be found than Eigen and JSON, and with
# pkg-config.
mkdir -p "$work/shared"
sed 's/COMPONENTS field/COMPONENTS field_shared/; s/qjulia::field/qjulia::field_shared/' \
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
sed 's/COMPONENTS field_shared/COMPONENTS nonsense/' "$work/shared/CMakeLists.txt" >"$work/none/CMakeLists.txt"
touch "$work/none/main.cpp"
cmake -S "$work/none" -B "$work/none_build" -DCMAKE_PREFIX_PATH="$work/prefix" \
  -DCMAKE_CXX_COMPILER="$compiler" >"$work/none.log" 2>&1 && exit 1
grep -q "no component 'nonsense'" "$work/none.log"

"$work/build/mine" "$repository/tests/data/wedge.obj" "$work/results" | tee "$work/figures"
grep -q '^n = 6: IoU 0\.[5-9]' "$work/figures"
for file in shape.qjulia.json shape.ply shape.png; do test -s "$work/results/$file"; done

# Where the field alone is installed, its files are there without the rest, and say what is missing.
mkdir -p "$work/alone"
for component in field_runtime field_dev; do
  cmake --install "$build" --prefix "$work/alone/prefix" --component $component >>"$work/install.log"
done
cmake -S "$work/field" -B "$work/alone/build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/alone/prefix" \
  -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags"
cmake --build "$work/alone/build"
"$work/alone/build/field" "$repository/docs/maps/bunny.qjulia.json" | cmp - "$work/field_at_origin"
(cd "$work/alone/prefix/include" && find qjulia -name '*.hpp' -printf '#include <%p>\n') |
  "$compiler" -std=c++20 -fsyntax-only -I"$work/alone/prefix/include" $(pkg-config --cflags eigen3) -x c++ -
if cmake -S "$work/parts" -B "$work/alone/none" -DPARTS=fit -DCMAKE_PREFIX_PATH="$work/alone/prefix" \
  -DCMAKE_CXX_COMPILER="$compiler" >"$work/none.log" 2>&1; then
  echo "finds a component that is not installed"
  exit 1
fi
grep -q "libqjulia-dev" "$work/none.log"
