// SPDX-License-Identifier: Apache-2.0
#include "mesh/vtk_file.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include <fmt/core.h>

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
  std::string bytes = fmt::format(
      "# vtk DataFile Version 3.0\n{}\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS {} double\n",
      kWriterMark, positions.size());
  const auto flush = [&](std::size_t done) {
    if (done % kVtkPiece != 0) return;
    if (options.stop.stop_requested()) throw stream::Stopped();
    file.write(bytes);
    bytes.clear();
  };
  for (std::size_t i = 0; i < positions.size(); flush(++i)) {
    for (const double c : positions[i]) append(bytes, c);
  }
  bytes += fmt::format("\nCELLS {} {}\n", tetrahedra.size(), 5 * tetrahedra.size());
  for (std::size_t t = 0; t < tetrahedra.size(); flush(++t)) {
    append(bytes, std::int32_t{4});
    for (const std::uint32_t corner : tetrahedra[t]) {
      append(bytes, static_cast<std::int32_t>(corner));
    }
  }
  bytes += fmt::format("\nCELL_TYPES {}\n", tetrahedra.size());
  constexpr std::int32_t kTetrahedron = 10;
  for (std::size_t t = 0; t < tetrahedra.size(); flush(++t)) append(bytes, kTetrahedron);
  bytes += fmt::format("\nPOINT_DATA {}\nSCALARS level unsigned_char 1\nLOOKUP_TABLE default\n",
                       levels.size());
  for (const std::uint8_t level : levels) bytes += static_cast<char>(level);
  bytes += '\n';
  file.write(bytes);
  file.commit();
}

}  // namespace terrace::terrain
