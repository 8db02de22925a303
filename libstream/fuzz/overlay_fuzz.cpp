// SPDX-License-Identifier: Apache-2.0
// A page of an overlay is refused with Damage, or is consistent and the same after rewriting.
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "store/overlay_page.hpp"

namespace {

void require(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

/// The first byte is the number of values, the rest is the page without its checksum.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  using namespace terrace::stream::store;
  if (size < 1) return 0;
  static const std::vector<LevelInfo> levels{{.level = 0, .clusters = 1000000},
                                             {.level = 1, .clusters = 5000},
                                             {.level = 2, .clusters = 1}};
  Bytes bytes(data + 1, data + size);
  put(bytes, crc32(bytes));  // added because a fuzzer cannot guess a checksum
  OverlayPage page;
  try {
    decode_overlay_page(bytes, data[0], levels, page);
  } catch (const Damage&) {
    return 0;
  }
  require(page.values.size() == data[0]);
  require(page.first.size() == page.clusters.size() + 1 && page.first.back() == data[0]);
  const Bytes again = encode_overlay_page(page);
  // A number may have been written in more bytes than necessary.
  require(again.size() <= bytes.size());
  OverlayPage second;
  decode_overlay_page(again, data[0], levels, second);
  require(second == page);
  return 0;
}
