// SPDX-License-Identifier: Apache-2.0
#include "store/overlay_page.hpp"

#include <cmath>
#include <limits>

namespace terrace::stream::store {

void OverlayPage::add(ClusterId cluster, const OverlayValue& value) {
  if (clusters.empty() || clusters.back() != cluster) {
    clusters.push_back(cluster);
    first.push_back(first.back());
  }
  values.push_back(value);
  ++first.back();
}

void OverlayPage::clear() {
  clusters.clear();
  first.assign(1, 0);
  values.clear();
}

Bytes encode_overlay_page(const OverlayPage& page) {
  Bytes out;
  put(out, static_cast<std::uint32_t>(page.clusters.size()));
  std::uint64_t before = 0;
  for (std::size_t c = 0; c < page.clusters.size(); ++c) {
    const auto id = static_cast<std::uint64_t>(page.clusters[c]);
    put_varint(out, id - before);
    before = id;
    const auto values = page.of(c);
    put_varint(out, values.size());
    std::uint64_t next = 0;
    for (const OverlayValue& value : values) {
      put_varint(out, value.index - next);
      next = std::uint64_t{value.index} + 1;
    }
  }
  for (const OverlayValue& value : page.values) put(out, value.value);
  put(out, crc32(out));
  return out;
}

void decode_overlay_page(ByteView bytes, std::uint64_t values, std::span<const LevelInfo> levels,
                         OverlayPage& page) {
  page.clear();
  if (bytes.size() < 8 || crc32(bytes.first(bytes.size() - 4)) !=
                              load<std::uint32_t>(bytes.data() + bytes.size() - 4)) {
    throw Damage("the checksum of the page is wrong");
  }
  ByteReader in(bytes.first(bytes.size() - 4));
  const auto clusters = in.get<std::uint32_t>();
  // Every value takes nine bytes, one of them for its index, and every cluster has a value.
  if (values > in.remaining() / 9 || clusters > values) {
    throw Damage("the page is too short for its values");
  }
  page.clusters.reserve(clusters);
  page.first.reserve(clusters + std::size_t{1});
  page.values.reserve(values);
  std::uint64_t before = 0;
  for (std::uint32_t c = 0; c < clusters; ++c) {
    const std::uint64_t step = in.varint();
    if ((c > 0 && step == 0) || step > std::numeric_limits<std::uint64_t>::max() - before) {
      throw Damage("the clusters of the page do not ascend");
    }
    before += step;
    const ClusterId id{before};
    if (level_of(id) >= levels.size() || ordinal_of(id) >= levels[level_of(id)].clusters) {
      throw Damage("the page has a cluster that the store does not have");
    }
    const std::uint64_t count = in.varint();
    if (count == 0 || count > values - page.values.size()) {
      throw Damage("a cluster of the page has an impossible number of values");
    }
    std::uint64_t next = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t gap = in.varint();
      if (next > std::numeric_limits<std::uint32_t>::max() ||
          gap > std::numeric_limits<std::uint32_t>::max() - next) {
        throw Damage("an index of the page is too large");
      }
      page.add(id, {static_cast<std::uint32_t>(next + gap), 0.0});
      next += gap + 1;
    }
  }
  if (page.values.size() != values || in.remaining() != 8 * values) {
    throw Damage("the page does not have the number of values stated in the directory");
  }
  for (OverlayValue& value : page.values) {
    value.value = in.get<double>();
    if (!std::isfinite(value.value)) throw Damage("a value of the page is not a finite number");
  }
}

}  // namespace terrace::stream::store
