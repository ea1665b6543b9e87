#!/bin/bash
# docs/reference holds what the tables say today.
# usage: reference.sh SOURCE_DIR PROGRAM
set -euo pipefail
"$2" | diff -u "$1/docs/reference/knobs.md" - || {
  echo "docs/reference/knobs.md is out of date: cmake --build --preset release --target reference"
  exit 1
}
