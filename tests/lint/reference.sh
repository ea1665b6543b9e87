#!/bin/bash
# docs/reference holds what the tables say today.
# usage: reference.sh SOURCE_DIR KNOBS_PROGRAM MANUAL_PROGRAM
set -euo pipefail
check() {
  diff -u "$1" - || {
    echo "$1 is out of date: cmake --build --preset release --target reference"
    exit 1
  }
}
"$2" | check "$1/docs/reference/knobs.md"
"$3" environment | check "$1/docs/reference/environment.md"
