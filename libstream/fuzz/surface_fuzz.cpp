// SPDX-License-Identifier: Apache-2.0
// The surface of a small store. The checksums are set first, so that input reaches the decoder. It
// must be refused with Error, or be a surface that can be written and read again.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fuzz_points.hpp"
#include "store/codec/bytes.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/stored_surface.hpp"

namespace terrace::stream {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Two clusters of level 1 below the root, each with two of level 0.
ClusterOrder small_order() {
  ClusterOrder order;
  order.clusters = {
      {.id = cluster_id(2, 0), .parent = kNoNumber, .next = 7, .begin = 0, .end = 24},
      {.id = cluster_id(1, 0), .parent = 0, .next = 4, .begin = 0, .end = 12, .representative = 11},
      {.id = cluster_id(0, 0), .parent = 1, .next = 3, .begin = 0, .end = 7, .representative = 6},
      {.id = cluster_id(0, 1), .parent = 1, .next = 4, .begin = 7, .end = 12, .representative = 11},
      {.id = cluster_id(1, 1),
       .parent = 0,
       .next = 7,
       .begin = 12,
       .end = 24,
       .representative = 23},
      {.id = cluster_id(0, 2),
       .parent = 4,
       .next = 6,
       .begin = 12,
       .end = 18,
       .representative = 17},
      {.id = cluster_id(0, 3),
       .parent = 4,
       .next = 7,
       .begin = 18,
       .end = 24,
       .representative = 23},
  };
  return order;
}

/// Sets the checksums of the header and of the clusters, as far as the bytes reach.
void set_checksums(std::size_t clusters, Bytes& bytes) {
  constexpr std::size_t kTableBytesAt = 36, kTablesAt = 40;
  if (bytes.size() < kTablesAt) return;
  const auto table_bytes = store::load<std::uint32_t>(bytes.data() + kTableBytesAt);
  if (table_bytes > bytes.size() - kTablesAt) return;
  std::size_t at = kTablesAt + table_bytes;
  std::vector<std::uint64_t> sizes;
  for (std::size_t c = 0; c < clusters; ++c) {
    std::uint64_t size = 0;
    for (unsigned shift = 0;; shift += 7) {
      if (at >= bytes.size() || shift > 28) return;
      const std::uint8_t byte = bytes[at++];
      size |= std::uint64_t{byte & 127U} << shift;
      if (byte < 128) break;
    }
    sizes.push_back(size);
  }
  const auto put = [&](std::size_t where, std::uint32_t value, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      bytes[where + i] = static_cast<std::uint8_t>(value >> (8 * i));
    }
  };
  if (bytes.size() - at < 4) return;
  put(at, store::crc32(std::span(bytes).first(at)), 4);
  at += 4;
  for (const std::uint64_t size : sizes) {
    if (size < 3 || size > bytes.size() - at) return;
    const auto part = static_cast<std::size_t>(size);
    put(at + part - 2, store::crc16(std::span(bytes).subspan(at, part - 2)), 2);
    at += part;
  }
}

std::vector<std::array<std::uint32_t, 3>> sorted(std::vector<std::array<std::uint32_t, 3>> all) {
  for (auto& t : all) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  std::sort(all.begin(), all.end());
  return all;
}

void check(const ClusterOrder& order, const Bytes& bytes) {
  const WorkLimit limit(bytes.size());
  StoredSurface surface;
  try {
    surface = decode_surface(order, std::as_bytes(std::span(bytes)), "surface.0");
  } catch (const Error&) {
    return;
  }
  const std::vector<std::byte> written = encode_surface(order, surface);
  const StoredSurface again = decode_surface(order, written, "surface.0");
  require(again.parents == surface.parents && again.errors == surface.errors &&
              again.levels == surface.levels &&
              sorted(again.triangles) == sorted(surface.triangles),
          "a surface that was read can be written and read again");
}

}  // namespace
}  // namespace terrace::stream

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  static const ClusterOrder order = small_order();
  Bytes bytes(data, data + size);
  check(order, bytes);
  set_checksums(order.clusters.size(), bytes);
  check(order, bytes);
  return 0;
}
