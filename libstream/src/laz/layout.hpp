// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "terrace/stream/laz.hpp"

namespace terrace::stream::laz {

/// The offsets of the items in a record, in bytes; 0 if absent.
struct RecordLayout {
  std::size_t length = 0;
  std::size_t gps_time = 0;  ///< of formats 0 to 5; in formats from 6 on it is part of the point
  std::size_t rgb = 0;
  std::size_t nir = 0;
  std::size_t wave_packet = 0;
  std::size_t extra = 0, extra_bytes = 0;
  unsigned version = 0;  ///< version of the items
};

/// Returns the layout of a VLR's records. Throws: std::invalid_argument for items that do not form
/// a point format.
RecordLayout layout_of(const Vlr& vlr);

}  // namespace terrace::stream::laz
