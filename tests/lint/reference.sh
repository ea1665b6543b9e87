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
# Names in quotes after getenv, and those of our own wherever they stand in quotes.
for name in $(grep -rhoE '(getenv\(|)"(QJULIA_[A-Z]+|[A-Z_]+)"' "$1"/host "$1"/tools --include='*.cpp' |
  grep -oE '^getenv\("[A-Z_]+|"QJULIA_[A-Z]+"' | grep -oE '[A-Z_]+' | sort -u); do
  grep -q "\b$name\b" "$1/docs/reference/environment.md" || {
    echo "$name is read from the environment; say so in tools/manual/environment.cpp"
    exit 1
  }
done
"$3" environment | check "$1/docs/reference/environment.md"
