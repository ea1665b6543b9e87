#!/bin/bash
# Doxygen understands the comments of all public headers. Usage: doxygen.sh REPOSITORY BUILD_FOLDER
set -euo pipefail
cd "$1"
(
  cat docs/site/Doxyfile
  echo "OUTPUT_DIRECTORY = $2/doxygen"
  echo 'WARN_AS_ERROR = FAIL_ON_WARNINGS'
) | doxygen -
test -s "$2/doxygen/xml/namespaceqjulia.xml"
