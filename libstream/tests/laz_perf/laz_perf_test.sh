#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# laz_perf_test.sh BUILD WRITE_FILES [FILE.laz...] checks that npm's laz-perf decodes the LAZ files, and
# npm's copc reads the COPC files, that this library writes. Installs both below BUILD if necessary; exits
# with 77 if they are not available. With files, prints how fast laz-perf decodes these instead.
set -eu
source=$(cd "${0%/*}" && pwd)
skip() {
  echo "skipped: $*"
  exit 77
}
for program in node npm; do
  command -v "$program" > /dev/null || skip "$program is not installed"
done
packages=$1/laz_perf
write_files=$2
shift 2
mkdir -p "$packages"
if ! cmp -s "$source/package-lock.json" "$packages/node_modules/.installed"; then
  cp "$source/package.json" "$source/package-lock.json" "$packages"
  npm ci --prefix "$packages" --ignore-scripts --no-audit --no-fund --prefer-offline \
    --fetch-retries=1 --fetch-retry-mintimeout=1000 --fetch-timeout=30000 > "$packages/npm.log" 2>&1 ||
    skip "the npm packages cannot be installed: see $packages/npm.log"
  cp "$source/package-lock.json" "$packages/node_modules/.installed"
fi
if [ $# -eq 0 ]; then
  mkdir -p "$packages/files" "$packages/octrees"
  "$write_files" "$packages/files" "$packages/octrees"
  node "$source/copc.mjs" "$packages" "$packages"/octrees/*.copc.laz
  set -- "$packages"/files/*.laz
fi
exec node "$source/laz_perf.mjs" "$packages" "$@"
