#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Runs an example in a folder of its own and checks that it made what it names.
# Usage: run_example.sh EXAMPLE FILE...
set -eu
example=$1
shift
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$example" "$folder"
for file in "$@"; do
  test -s "$folder/$file" || { echo "$example made no $file" >&2; exit 1; }
done
