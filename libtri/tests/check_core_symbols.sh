#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# check_core_symbols.sh NM ARCHIVES...: fails if the core in these archives needs an undefined function of its own library,
# or of CGAL, GMP or MPFR.
set -eu
nm=$1
shift
defined=$("$nm" --defined-only "$@" | awk 'NF == 3 { print $3 }' | sort -u)
needed=$("$nm" --undefined-only "$@" | awk '$1 == "U" { print $2 }' | sort -u)
echo "$defined" | grep -q 9Delaunay2Ii || { echo "no triangulation in $1"; exit 1; }
# Symbols such as _ZN7terrace... are ours and must be defined here too.
foreign=$(echo "$needed" | grep -E '7terrace|CGAL|gmp|mpf|mpq|mpz' | while read -r name; do
  echo "$defined" | grep -qxF "$name" || echo "$name"
done)
if [ -n "$foreign" ]; then
  echo "$foreign"
  echo "the core needs the functions above, which it lacks"
  exit 1
fi
