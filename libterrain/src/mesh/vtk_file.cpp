// SPDX-License-Identifier: Apache-2.0
#include "mesh/vtk_file.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "base/file_marks.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::terrain {
namespace {

/// Appends a value in big-endian order, as legacy VTK files require.
template <class T>
void append(std::string& bytes, T value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  if constexpr (std::endian::native == std::endian::little) std::reverse(raw, raw + sizeof raw);
  bytes.append(raw, sizeof raw);
}

constexpr std::size_t kVtkPiece = 65536;

}  // namespace

void write_vtk(const std::string& path, std::span<const stream::Point3> positions,
               std::span<const std::uint8_t> levels,
               std::span<const std::array<std::uint32_t, 4>> tetrahedra,
               const stream::WriterOptions& options) {
  stream::AtomicFile file(path, options.replace);
  std::string bytes = "# vtk DataFile Version 3.0\n" + std::string(kWriterMark) +
                      "\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS " +
                      std::to_string(positions.size()) + " double\n";
  const auto flush = [&](std::size_t done) {
    if (done % kVtkPiece != 0) return;
    if (options.stop.stop_requested()) throw stream::Stopped();
    file.write(bytes);
    bytes.clear();
  };
  for (std::size_t i = 0; i < positions.size(); flush(++i)) {
    for (const double c : positions[i]) append(bytes, c);
  }
  bytes += "\nCELLS " + std::to_string(tetrahedra.size()) + ' ' +
           std::to_string(5 * tetrahedra.size()) + '\n';
  for (std::size_t t = 0; t < tetrahedra.size(); flush(++t)) {
    append(bytes, std::int32_t{4});
    for (const std::uint32_t corner : tetrahedra[t]) {
      append(bytes, static_cast<std::int32_t>(corner));
    }
  }
  bytes += "\nCELL_TYPES " + std::to_string(tetrahedra.size()) + '\n';
  constexpr std::int32_t kTetrahedron = 10;
  for (std::size_t t = 0; t < tetrahedra.size(); flush(++t)) append(bytes, kTetrahedron);
  bytes += "\nPOINT_DATA " + std::to_string(levels.size()) +
           "\nSCALARS level unsigned_char 1\nLOOKUP_TABLE default\n";
  for (const std::uint8_t level : levels) bytes += static_cast<char>(level);
  bytes += '\n';
  file.write(bytes);
  file.commit();
}

}  // namespace terrace::terrain
