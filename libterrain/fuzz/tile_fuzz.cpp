// SPDX-License-Identifier: Apache-2.0
// The files of a tile folder. The first byte says which: 't' a tile, 'l' layer.json, 'j' the
// journal after its first line. A readable tile must be checkable, and the other files must be the
// same after they have been written and read again.
#include <algorithm>
#include <fstream>
#include <span>

#include "fuzz_target.hpp"
#include "terrace/stream/error.hpp"
#include "tile/format/layer.hpp"
#include "tile/format/quantized_mesh.hpp"
#include "tile/set/journal.hpp"
#include "tile/verify/checks.hpp"

namespace terrace::terrain::fuzz {

namespace {

bool read_tile(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
  const DecodedTile tile = decode_tile(bytes, "fuzz.terrain");
  const TileMesh& mesh = tile.mesh;
  require(mesh.v.size() == mesh.size() && mesh.height.size() == mesh.size(), "as many v and h");
  require(mesh.normals.empty() || mesh.normals.size() == mesh.size(), "a normal for each vertex");
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t v : triangle) require(v < mesh.size(), "corners are vertices");
  }
  require(6 * mesh.size() <= bytes.size() && 6 * mesh.triangles.size() <= bytes.size(),
          "no more than the bytes can hold");
  const auto faults =
      check_tile_mesh({3, 5, 2}, tile, {"octvertexnormals", "watermask", "metadata"});
  for (const TileFault& fault : faults) require(!fault.what.empty(), "a fault has a text");
  return true;
}

bool read_description(std::string_view text) {
  const MemoryFile file(text);
  const TileLayer layer = read_layer(file.name());
  require(layer.available.size() == layer.last_zoom + 1 && layer.first_zoom <= layer.last_zoom,
          "zooms");
  for (unsigned zoom = 0; zoom <= layer.last_zoom; ++zoom) {
    for (const TileRange& range : layer.available[zoom]) {
      require(range.x0 <= range.x1 && range.x1 < tile_columns(zoom) && range.y0 <= range.y1 &&
                  range.y1 < tile_rows(zoom),
              "tiles of that zoom");
    }
  }
  const MemoryFile written(layer_json(layer));
  const TileLayer again = read_layer(written.name());
  require(again.available == layer.available && again.name == layer.name &&
              again.bounds == layer.bounds && again.extensions == layer.extensions &&
              again.first_zoom == layer.first_zoom && again.max_errors == layer.max_errors &&
              again.fingerprint == layer.fingerprint,
          "the layer reads back as written");
  return true;
}

bool read_journal(std::string_view text) {
  static const ScratchFolder scratch;
  const std::string folder = scratch.path().string();
  const auto write = [&] {
    std::ofstream file(scratch.path() / TileJournal::kName, std::ios::binary);
    file << "terrace tiles 2 " << TERRACE_TERRAIN_VERSION << '\n' << text;
  };
  write();
  const std::vector<TileJournal::Record> records = read_tile_records(folder);
  require(records.size() <= text.size() / 14, "a record takes 14 bytes at least");
  require(std::is_sorted(records.begin(), records.end(),
                         [](const auto& a, const auto& b) { return a.first < b.first; }),
          "records are sorted");
  {
    TileJournal journal(folder);
    for (const auto& [tile, finished] : records) {
      const FinishedTile* const found = journal.find(tile);
      require(found != nullptr && found->checksum == finished.checksum, "a record is found");
    }
    journal.add({1, 2, 1}, {.bytes = 7, .checksum = 8, .inputs = 9, .max_error = 0.5});
  }
  const std::vector<TileJournal::Record> more = read_tile_records(folder);
  require(more.size() >= std::max<std::size_t>(records.size(), 1), "the journal continues");
  return !records.empty();
}

}  // namespace

bool accepts(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return false;
  const std::string_view text = text_of(data + 1, size - 1);
  try {
    if (data[0] == 't') return read_tile(text);
    if (data[0] == 'l') return read_description(text);
    if (data[0] == 'j') return read_journal(text);
  } catch (const stream::Error& error) {
    require(!error.parts().cause.empty(), "a cause");
  }
  return false;
}

}  // namespace terrace::terrain::fuzz
