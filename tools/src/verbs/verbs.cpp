// SPDX-License-Identifier: GPL-3.0-or-later
#include "verbs/verbs.hpp"

#include <array>

namespace terrace::tools {

std::span<const Verb> verbs() {
  static const std::array<Verb, 19> kVerbs{{
      {"build", "stream the inputs once and write a store", "terrace build dem.tif -o dem.terrace",
       make_build},
      {"merge", "join stores without building them again",
       "terrace merge north.terrace south.terrace -o all.terrace", make_merge},
      {"info", "describe a store or a file", "terrace info dem.tif --json", make_info},
      {"verify", "check every checksum and invariant", "terrace verify dem.terrace", make_verify},
      {"points", "write the points of a level, a region, or mixed levels",
       "terrace points dem.terrace --level 2 -o coarse.ply", make_points},
      {"mesh", "write a triangle mesh with local detail",
       "terrace mesh dem.terrace --level top --focus 500000,5000000,510000,5010000:0 -o mesh.ply",
       make_mesh},
      {"surface", "write a 3D surface", "terrace surface scan.terrace -o scan.ply", make_surface},
      {"tile", "write terrain tiles for web globes",
       "terrace tile dem.terrace --vertical ellipsoidal -o tiles", make_tile, "--resume"},
      {"sample", "look up heights and slopes at points",
       "terrace sample dem.terrace --points places.csv", make_sample},
      {"raster", "interpolate a GeoTIFF", "terrace raster dem.terrace --cell 90 -o coarse.tif",
       make_raster},
      {"profile", "write heights along a line",
       "terrace profile dem.terrace --line path.geojson -o profile.csv", make_profile},
      {"contour", "write contour lines",
       "terrace contour dem.terrace --interval 50 -o lines.geojson", make_contour},
      {"cluster", "cluster one point file in memory", "terrace cluster cloud.ply -o clustered.ply",
       make_cluster},
      {"match", "match points in pairs at the least total distance",
       "terrace match places.csv -o pairs.csv", make_match},
      {"render", "draw a picture", "terrace render mesh.ply --wire -o mesh.png", make_render},
      {"view", "open the interactive viewer", "terrace view dem.terrace", make_view},
      {"publish", "write a folder for any web server", "terrace publish dem.terrace -o public",
       make_publish},
      {"synth", "make test inputs", "terrace synth dem --size 4096x4096 -o dem.tif", make_synth},
      {"convert", "convert between point formats", "terrace convert scan.ply -o scan.xyz",
       make_convert},
  }};
  return kVerbs;
}

}  // namespace terrace::tools
