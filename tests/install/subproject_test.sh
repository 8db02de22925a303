#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Configures each library as a separate project. Then copies it into the subprojects of a
# third-party project, which must find it by name and not build its tests. That project has options
# with very common names. The workspace itself is built from these subprojects, so little is
# compiled again: files that include each library, and one library as a whole.
# Usage: subproject_test.sh SOURCE
set -eu
source=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir "$folder/subprojects"

cat >"$folder/meson_options.txt" <<'OPTIONS'
option('tests', type : 'boolean', value : true)
option('bench', type : 'boolean', value : true)
option('fuzz', type : 'boolean', value : true)
OPTIONS
cat >"$folder/meson.build" <<'BUILD'
project('stranger', 'cpp', default_options : ['cpp_std=c++20'])
BUILD
for library in base stream cluster matching tri terrain; do
  mkdir "$folder/subprojects/terrace-$library"
  (cd "$source/lib$library" && tar -c --exclude './build*' .) | tar -x -C "$folder/subprojects/terrace-$library"
  cat >>"$folder/meson.build" <<BUILD
executable('use_$library', 'use_$library.cpp', override_options : 'unity=off',
  dependencies : dependency('terrace-$library'))
BUILD
done
cp "$source"/tests/install/use_*.cpp "$folder"

for library in base stream cluster matching tri terrain; do
  meson setup "$folder/alone-$library" "$source/lib$library" >"$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
done
# Unoptimised, because this tests the build and not the result.
meson setup "$folder/build" "$folder" --buildtype=plain -Dunity=on -Dunity_size=30 >"$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
ninja -C "$folder/build" use_base use_matching use_stream.p/use_stream.cpp.o use_cluster.p/use_cluster.cpp.o \
  use_tri.p/use_tri.cpp.o use_terrain.p/use_terrain.cpp.o >"$folder/log" 2>&1 || { tail -n 50 "$folder/log"; exit 1; }
if grep -o 'subprojects/[^ ]*_tests' "$folder/build/build.ninja"; then
  echo 'a subproject would build its tests'
  exit 1
fi
for program in use_base use_matching; do
  "$folder/build/$program" || { echo "$program failed"; exit 1; }
done
