#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Creates a fractal DEM and a scanned body, describes them, and draws pictures of them.
# Usage: first_look.sh FOLDER (TERRACE=path/to/terrace unless it is installed)
set -eu
terrace=${TERRACE:-terrace}
folder=${1:-.}

"$terrace" synth dem --size 1024x1024 -o "$folder/dem.tif"
"$terrace" info "$folder/dem.tif"
"$terrace" render "$folder/dem.tif" --view 200,40 -o "$folder/dem.png"

"$terrace" synth surface --points 200k --shuffle pieces:1000-5000 -o "$folder/scan.ply"
"$terrace" convert "$folder/scan.ply" -o "$folder/scan.csv"
"$terrace" render "$folder/scan.csv" --view 30,20 --size 800x800 -o "$folder/scan.png"

# For programs: one JSON object.
"$terrace" info "$folder/dem.tif" --json >"$folder/dem.json"
