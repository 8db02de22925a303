#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# check_core_symbols.sh NM ARCHIVES...: fails if the core in these archives needs a function of libtri that it does not
# define, or a function of CGAL, GMP or MPFR.
set -eu
nm=$1
shift
defined=$("$nm" --defined-only "$@" | awk 'NF == 3 { print $3 }' | sort -u)
needed=$("$nm" --undefined-only "$@" | awk '$1 == "U" { print $2 }' | sort -u)
echo "$defined" | grep -q 9Delaunay2Ii || { echo "$1 does not contain the triangulation"; exit 1; }
# Symbols such as _ZN7terrace... are ours and must be defined here too.
foreign=$(echo "$needed" | grep -E '7terrace|CGAL|gmp|mpf|mpq|mpz' | while read -r name; do
  echo "$defined" | grep -qxF "$name" || echo "$name"
done)
if [ -n "$foreign" ]; then
  echo "$foreign"
  echo "the core must not need the functions above"
  exit 1
fi
