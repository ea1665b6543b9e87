#!/bin/bash
# Fills kernel caches with every program as `doctor` builds it, which takes a minute, once for all of them.
#   warm_caches.sh COMMAND KERNELS_FOLDER WORK_FOLDER CACHE...
# Nothing is built again while no kernel changes. Whether the programs work is for other tests to find.
set -euo pipefail
command=$1 kernels=$2 work=$3
shift 3

built=$work/built
if [[ ! -e $built || -n $(find "$kernels" "$command" -newer "$built" -print -quit) ]]; then
  rm -rf "$work"
  mkdir -p "$work"
  for layout in cpu gpu; do
    POCL_CACHE_DIR=$work/$layout XDG_CACHE_HOME=$work "$command" doctor --layout "$layout" --device cpu \
      >"$work/$layout.log" 2>&1 || echo "doctor --layout $layout failed; tests build what is missing" &
  done
  wait
  touch "$built"
fi
for cache in "$@"; do
  [[ $cache/warm -nt $built ]] && continue
  mkdir -p "$cache"
  cp -r "$work"/{cpu,gpu}/. "$cache"
  touch "$cache/warm"
done
