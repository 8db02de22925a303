// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// How `unpack_samples` reads samples that are not a native type.
struct PackedSamples {
  std::uint16_t sample_format = 1;  ///< as in the TIFF
  unsigned bits = 8;
  ScalarType type = ScalarType::u8;  ///< the type to produce
};

/// True if libtiff already delivers the samples as native values of `packed.type`.
bool is_native(const PackedSamples& packed);

/// Widens `count` packed samples to native values; the first is sample number `first` of the row
/// `from`, each further one `step` samples later. Integers of odd widths are packed from the
/// highest bit on, as in GDAL; so are those of 24 bits, although libtiff swaps their bytes in files
/// of the other byte order. Floats of 16 and 24 bits are in native byte order.
void unpack_samples(const PackedSamples& packed, const std::byte* from, std::size_t first,
                    std::size_t step, std::size_t count, std::byte* out);

/// The exact value of a float of 16 bits (IEEE) or 24 bits (1 sign, 7 exponent, 16 mantissa).
float float_from_16(std::uint16_t bits);
float float_from_24(std::uint32_t bits);

}  // namespace terrace::stream
