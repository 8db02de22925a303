// SPDX-License-Identifier: Apache-2.0
#include "tile/set/inputs.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <string_view>
#include <vector>

#include <terrace/stream/error.hpp>

#include "base/digest.hpp"

namespace terrace::terrain {
namespace {

/// Version of the algorithm. Increment it when equal inputs give other bytes.
constexpr std::uint64_t kGeneration = 4;

}  // namespace

GeographicBox input_box(const TileAddress& tile, const TileSurface& surface) {
  // Sides use a unit beyond the tile, normals a sample or a 256th of the tile.
  const GeographicBox box = box_of(tile);
  const double distance = 1.01 * std::max(surface.spacing(), (box.east - box.west) / 256.0);
  return {box.west - distance, box.south - distance, box.east + distance, box.north + distance};
}

std::uint64_t digest_of(const TileAddress& tile, const ZoomPlan& plan, const TileInputs& inputs,
                        TileSurface& surface) {
  Digest digest;
  digest.add(kGeneration);
  for (const std::uint64_t number :
       {std::uint64_t{tile.zoom}, std::uint64_t{tile.x}, std::uint64_t{tile.y}}) {
    digest.add(number);
  }
  for (const double number :
       {plan.max_error, plan.height_step, plan.longest_edge, plan.widest_leaf}) {
    digest.add(number);
  }
  digest.add(static_cast<std::uint64_t>(inputs.mesh.quality));
  for (const bool flag : {inputs.mesh.normals, inputs.mesh.water, inputs.gzip}) {
    digest.add(std::uint64_t{flag});
  }
  digest.add(std::string_view(inputs.source_options));
  digest.add(std::string_view(inputs.metadata));
  digest.add(surface.digest(input_box(tile, surface)));
  return digest.value();
}

std::uint64_t digest_of_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<char> block(std::size_t{1} << 20);
  Digest digest;
  while (file) {
    file.read(block.data(), static_cast<std::streamsize>(block.size()));
    digest.add(std::string_view(block.data(), static_cast<std::size_t>(file.gcount())));
  }
  if (!file.eof()) throw stream::system_error(path, "cannot be read", errno);
  return digest.value();
}

}  // namespace terrace::terrain
