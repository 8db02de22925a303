#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# check_symbols.sh NM ARCHIVE: fails if the archive defines a weak function that does not name its
# instruction set. The linker may use such a function for the whole program, which would then crash
# on processors that lack the instructions.
set -eu
symbols=$("$1" --defined-only "$2")
echo "$symbols" | grep -q run_engine || { echo "no engine in $2"; exit 1; }
if echo "$symbols" | grep ' W ' | grep -v -E '4Avx2|6Avx512'; then
  echo "the functions above may be shared with code for other processors"
  exit 1
fi
