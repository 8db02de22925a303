#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# check_wasm.sh EM++ LIBTRI FOLDER SOURCES...: compiles the core and examples/flight.cpp for WebAssembly and runs it;
# Skipped without Emscripten. All sources are compiled together, which takes a fraction of the time.
set -eu
compiler=$1 root=$2 folder=$3/wasm
shift 3
[ -n "$compiler" ] || { echo "skipped: em++ (Emscripten) is not installed"; exit 77; }
mkdir -p "$folder"
printf '#include "%s"\n' "$@" > "$folder/core.cpp"
"$compiler" -std=c++20 -O1 -fexceptions -Wall -Wextra -Wshorten-64-to-32 -Werror -DTERRACE_TRI_CORE -DNDEBUG -ffp-contract=off \
  -sALLOW_MEMORY_GROWTH=1 -sSINGLE_FILE=1 -I "$root/include" -I "$root/src" -I "$root/subprojects/terrace-base/include" "$folder/core.cpp" "$root/examples/flight.cpp" -o "$folder/flight.js"
node "$folder/flight.js"
