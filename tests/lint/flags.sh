#!/bin/bash
# The library names fields of options structs; only the application knows options of the command
# line: no string or comment of host/, include/ or kernels/ holds one. Options of other programs, by
# which containers are started, are in host/base/surroundings.cpp alone. Usage: flags.sh REPOSITORY
set -euo pipefail
cd "$1"
folders=(host include kernels)
# In a comment, or inside quotes; a decrement is neither.
pattern='(//|/\*|["`])(.*[^-[:alnum:]_(\[])?--[a-z][a-z-]+'
if grep -rnE "$pattern" --include='*.cpp' --include='*.hpp' --include='*.h' --include='*.cl' \
  --include='*.clh' --exclude=surroundings.cpp "${folders[@]}"; then
  echo "^ options of the command line in the library: name the field instead"
  exit 1
fi
echo "no option of the command line in $(grep -rlc '' "${folders[@]}" | wc -l) files"
