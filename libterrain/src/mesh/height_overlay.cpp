// SPDX-License-Identifier: Apache-2.0
#include "mesh/height_overlay.hpp"

#include "terrace/stream/error.hpp"

namespace terrace::terrain {

stream::Overlay open_height_overlay(const std::string& path, const stream::Store& store) {
  stream::Overlay overlay = stream::Overlay::open(path, store);
  const std::string& heights = store.schema().coordinates[2].name;
  if (overlay.channel() != heights) {
    throw stream::Error({.file = path,
                         .where = {},
                         .cause = "has other values of '" + overlay.channel() +
                                  "', not of the heights '" + heights + "'",
                         .remedy = "name an overlay that terrace mesh has written"});
  }
  return overlay;
}

}  // namespace terrace::terrain
