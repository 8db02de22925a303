// SPDX-License-Identifier: Apache-2.0
#include "bytes.hpp"

#include <libdeflate.h>

namespace terrace::stream::store {

std::uint32_t crc32(std::uint32_t crc, const void* data, std::size_t size) {
  return libdeflate_crc32(crc, data, size);
}

}  // namespace terrace::stream::store
