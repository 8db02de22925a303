#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the build into a temporary folder; then every public header must compile with nothing but
# its own library's pkg-config flags, and consumer.cpp, which uses all five, must build and run.
# Usage: install_test.sh BUILD SOURCE PREFIX LIBDIR STATIC-OR-SHARED COMPILER...
set -eu
build=$1 source=$2 prefix=$3 libdir=$4 kind=$5
shift 5

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
meson install -C "$build" --no-rebuild --quiet --destdir "$folder/root"
installed=$folder/root$prefix
export PKG_CONFIG_PATH="$installed/$libdir/pkgconfig"
flags() { pkg-config --define-variable=prefix="$installed" "$@"; }

for library in stream cluster matching tri terrain; do
  (cd "$source/lib$library/include" && find . -name '*.hpp') | sed 's,^\./,,' | sort >"$folder/expected"
  (cd "$installed/include" && find "terrace/$library" -name '*.hpp') | sort >"$folder/found"
  diff "$folder/expected" "$folder/found" || { echo "the installed headers of $library differ"; exit 1; }
  sed 's,.*,#include <&>,' "$folder/found" >"$folder/headers.cpp"
  # shellcheck disable=SC2046  # flags are words
  "$@" $(flags --cflags "terrace-$library") -fsyntax-only "$folder/headers.cpp"
done

if [ "$kind" = static ]; then static=--static; else static=; fi
# shellcheck disable=SC2046,SC2086
"$@" "$source/tests/install/consumer.cpp" -o "$folder/consumer" \
  $(flags --cflags --libs $static terrace-terrain terrace-stream terrace-cluster terrace-matching terrace-tri)
mkdir "$folder/work"
LD_LIBRARY_PATH="$installed/$libdir" "$folder/consumer" "$folder/work"
