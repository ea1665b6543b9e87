#!/bin/bash
# Every source is formatted as .clang-format says. Usage: format.sh REPOSITORY
set -euo pipefail
cd "$1"
mapfile -t files < <(find examples host include kernels python tests tools -type f -regex '.*\.\(cpp\|hpp\|h\|cl\|clh\)')
((${#files[@]} > 0)) || { echo "no sources under $1"; exit 1; }
clang-format --dry-run --Werror "${files[@]}"
echo "${#files[@]} files are formatted"
