#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Runs an example in a temporary folder and checks that it created the named files.
# Usage: run_example.sh EXAMPLE FILE...
set -eu
example=$1
shift
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$example" "$folder"
for file in "$@"; do
  test -s "$folder/$file" || { echo "$example did not create $file" >&2; exit 1; }
done
