// SPDX-License-Identifier: Apache-2.0
#include <string_view>
#include <vector>

#include "fuzz_points.hpp"

/// Any input is refused, or has no more positions than the file can hold, and polylines have as
/// many vertices as segments.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  const WorkLimit limit(size);
  const MemoryFile file(data, size);
  std::vector<std::uint64_t> vertices;
  for (const Entities entities : {Entities::points, Entities::segments, Entities::polylines}) {
    try {
      const auto source =
          open_source(std::vector{file.name()}, {.format = "geojson", .entities = entities});
      const SourceInfo& info = source->info();
      std::uint64_t vertex_count = 0;
      for (PointBlock block; source->next(block);) {
        require(block.payload.size() == block.size() * info.payload_size(),
                "each point has a record");
        if (entities == Entities::points) {
          vertex_count += block.size();
          continue;
        }
        const std::size_t column = entities == Entities::segments ? 3 : 3 * (kPolylineVertices - 1);
        const auto part = info.view<std::uint32_t>(block.payload, column + 1);
        const auto count = info.view<std::uint8_t>(block.payload, column + 2);
        for (std::size_t i = 0; i < block.size(); ++i) {
          require(count[i] >= 2 && count[i] <= kPolylineVertices, "a piece has 2 to 4 vertices");
          vertex_count += count[i] - (part[i] == 0 ? 0u : 1u);
        }
      }
      require(vertex_count <= size, "positions fit the file's size");
      vertices.push_back(vertex_count + source->progress().excluded);
    } catch (const Error& error) {
      require(!error.parts().cause.empty(), "errors have a cause");
      // Only lines have properties.
      if (std::string_view(error.what()).find("numeric properties") != std::string_view::npos)
        return 0;
    }
  }
  require(vertices.size() == 3 || vertices.empty(),
          "either all kinds of entities are refused or none");
  for (const std::uint64_t count : vertices) require(count == vertices.front(), "counts agree");
  return 0;
}
