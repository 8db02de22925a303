// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "format/las/fields.hpp"
#include "format/las/record_reader.hpp"
#include "terrace/stream/input.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// Points in little-endian records of equal length, and their interpretation.
struct RecordStream {
  /// info.points: the number in `records`. The coordinates have the types of the record.
  SourceInfo info{};
  std::size_t record_bytes = 0;
  std::array<std::size_t, 3> coordinate_offsets{0, 4, 8};
  std::vector<LasField> fields{};  ///< fields of info.attributes
  std::unique_ptr<Input> input{};  ///< the input of `records`, unless they have their own file
  std::unique_ptr<RecordReader> records{};
  std::uint64_t points = 0;  ///< number in the file, including those not selected
};

/// Returns a source of these points. placement: the common_placement() of several files, to which
/// the points are moved; null for a single file. Throws: Error if they are not on its lattice.
/// next() throws what the RecordReader throws, and Error for coordinates that are not finite or are
/// out of range after the move.
std::unique_ptr<PointSource> source_of_records(RecordStream stream, std::size_t block_points,
                                               const Placement* placement);

}  // namespace terrace::stream
