#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# clients_test.sh BUILD TEST [ARGUMENTS]: installs the clients below BUILD unless they exist, and
# runs the test there: TEST FOLDER ARGUMENTS. TERRACE names the command. Exits with 77 if a client
# cannot be installed.
set -eu
source=$(cd "${0%/*}" && pwd)
build=$1 test=$2
shift 2
skip() {
  echo "clients are not tested: $*"
  exit 77
}
for program in node npm chromium; do
  command -v "$program" > /dev/null || skip "$program is not installed"
done
[ "$(node -p 'process.versions.node.split(".")[0]')" -ge 20 ] || skip 'node is older than 20'

mkdir -p "$build/clients"
packages=$(cd "$build/clients" && pwd)
# Only one process installs at a time.
exec 9> "$packages/lock"
flock 9
cp "$source/package.json" "$source/package-lock.json" "$packages"
# This copy is made last, so it marks a complete installation.
if ! cmp -s "$packages/package-lock.json" "$packages/node_modules/.clients"; then
  if ! npm ci --prefix "$packages" --ignore-scripts --no-audit --no-fund --prefer-offline \
      --fetch-retries=1 --fetch-retry-mintimeout=1000 --fetch-timeout=30000 \
      > "$packages/npm.log" 2>&1; then
    unreachable='ENOTFOUND|EAI_AGAIN|ECONN|ETIMEDOUT|ENETUNREACH|EHOSTUNREACH|ENOTCACHED'
    if grep -Eq "$unreachable" "$packages/npm.log"; then
      skip 'the packages of npm cannot be downloaded here'
    fi
    cat "$packages/npm.log"
    exit 1
  fi
  cp "$packages/package-lock.json" "$packages/node_modules/.clients"
fi
exec 9>&-
CHROMIUM=$(command -v chromium) exec node "$test" "$packages" "$@"
