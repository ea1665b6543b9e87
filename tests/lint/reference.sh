#!/bin/bash
# docs/reference holds what the tables say today, and every variable that is read.
# usage: reference.sh SOURCE_DIR KNOBS_PROGRAM MANUAL_PROGRAM
set -euo pipefail
check() {
  diff -u "$1" - || {
    echo "$1 is out of date: cmake --build --preset release --target reference"
    exit 1
  }
}
"$2" | check "$1/docs/reference/knobs.md"
"$2" files | check "$1/docs/reference/file-types.md"
python3 "$1/tools/reference/schemas.py" "$1" | check "$1/docs/reference/json.md"
for format in $(grep -rhoE 'Format = "qjulia-[a-z-]+"' "$1/host" "$1/tools" | grep -oE 'qjulia-[a-z-]+' | sort -u); do
  grep -q "\`$format\`" "$1/docs/reference/json.md" || {
    echo "no page describes files of the format $format; add it to tools/reference/schemas.py"
    exit 1
  }
done
"$3" commands | check "$1/docs/reference/command-line.md"
# What getenv is called with, and names of our own that are passed on to it.
for name in $(grep -rhoE --include='*.cpp' 'getenv\("[A-Z_]+|"QJULIA_[A-Z]+"' "$1"/host "$1"/tools |
  grep -oE '[A-Z_]+' | sort -u); do
  grep -q "\b$name\b" "$1/docs/reference/environment.md" || {
    echo "$name is read from the environment; say so in tools/manual/environment.cpp"
    exit 1
  }
done
"$3" environment | check "$1/docs/reference/environment.md"
