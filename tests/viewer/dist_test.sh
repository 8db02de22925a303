#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# dist_test.sh SOURCE BUILD: rebuilds the viewer below BUILD and compares it byte for byte with
# viewer/dist. Skipped (77) if Emscripten, npm or its packages are not available.
set -eu
source=$1 build=$2
skip() {
  echo "the viewer is not rebuilt: $*"
  exit 77
}
for program in em++ make node npm; do
  command -v "$program" > /dev/null || skip "$program is not installed; this needs Emscripten, make, node and npm"
done
em++ --version | grep -q ' 3\.1\.6' || skip 'Emscripten is not 3.1.6, and other versions make different bytes'

make -s -j"$(nproc)" -f "$source/viewer/core/Makefile" ROOT="$source" OUT="$build/viewer-core" all
mkdir -p "$build/viewer-sources"
cp -R "$source/viewer/src" "$source"/viewer/*.json "$source/viewer/build.mjs" "$build/viewer-sources"
cd "$build/viewer-sources"
# This copy is made last, so it marks a complete installation.
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
  cmp "$file" "$source/viewer/dist/${file##*/}" || status=1
done
[ $status = 0 ] || echo 'viewer/dist does not match its sources; run ./dev viewer'
exit $status
