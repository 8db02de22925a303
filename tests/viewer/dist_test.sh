#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# dist_test.sh SOURCE BUILD: builds the viewer anew below BUILD and compares it byte for byte with tools/viewer/dist. Skipped
# (77) where Emscripten or npm is missing, or the packages of npm cannot be had.
set -eu
source=$1 build=$2
skip() {
  echo "the viewer is not built anew: $*"
  exit 77
}
for program in em++ make node npm; do
  command -v "$program" > /dev/null || skip "$program is not installed, of Emscripten, make, node and npm"
done
em++ --version | grep -q ' 3\.1\.6' || skip 'another Emscripten than 3.1.6 makes other bytes'

make -s -j"$(nproc)" -f "$source/tools/viewer/core/Makefile" ROOT="$source" OUT="$build/viewer-core" all
mkdir -p "$build/viewer-sources"
cp -R "$source/tools/viewer/src" "$source"/tools/viewer/*.json "$source/tools/viewer/build.mjs" "$build/viewer-sources"
cd "$build/viewer-sources"
# The list of what is installed is put there last.
if ! cmp -s package-lock.json node_modules/.viewer; then
  if ! npm ci --no-audit --no-fund --prefer-offline --fetch-retries=1 --fetch-retry-mintimeout=1000 --fetch-timeout=30000 > npm.log 2>&1; then
    grep -Eq 'ENOTFOUND|EAI_AGAIN|ECONN|ETIMEDOUT|ENETUNREACH|EHOSTUNREACH|ENOTCACHED' npm.log && skip 'the packages of npm cannot be downloaded here'
    cat npm.log
    exit 1
  fi
  cp package-lock.json node_modules/.viewer
fi
npm run --silent check
node build.mjs "$build/viewer-dist"
cp "$build/viewer-core/core.wasm" "$build/viewer-core/body.wasm" "$build/viewer-dist"
status=0
for file in "$build"/viewer-dist/*; do
  cmp "$file" "$source/tools/viewer/dist/${file##*/}" || status=1
done
[ $status = 0 ] || echo 'tools/viewer/dist is not what the sources make; run ./dev viewer'
exit $status
