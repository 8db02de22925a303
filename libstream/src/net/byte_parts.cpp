// SPDX-License-Identifier: Apache-2.0
#include "net/byte_parts.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace terrace::stream::net {
namespace {

constexpr std::uint64_t kMaxGap = std::uint64_t{256} << 10;
/// A gap that costs less than a request.
constexpr std::uint64_t kSmallGap = std::uint64_t{4} << 10;
constexpr std::uint64_t kFreeGaps = std::uint64_t{64} << 10;
constexpr std::uint64_t kGapShare = 4;
constexpr std::uint64_t kMaxPart = std::uint64_t{8} << 20;

std::uint64_t end_of(const BytePart& part) { return part.offset + part.bytes; }

/// Sorts parts and joins those that touch.
std::vector<BytePart> disjoint(std::vector<BytePart> parts) {
  std::sort(parts.begin(), parts.end(),
            [](const BytePart& a, const BytePart& b) { return a.offset < b.offset; });
  std::vector<BytePart> out;
  for (const BytePart& part : parts) {
    if (part.bytes == 0) continue;
    if (!out.empty() && part.offset <= end_of(out.back())) {
      out.back().bytes = std::max(end_of(out.back()), end_of(part)) - out.back().offset;
    } else {
      out.push_back(part);
    }
  }
  return out;
}

}  // namespace

std::vector<BytePart> joined_parts(std::vector<BytePart> parts) {
  parts = disjoint(std::move(parts));
  std::uint64_t needed = 0;
  for (const BytePart& part : parts) needed += part.bytes;
  std::vector<std::pair<std::uint64_t, std::size_t>> gaps;  // size, and number of the part after it
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const std::uint64_t gap = parts[i].offset - end_of(parts[i - 1]);
    if (gap <= kMaxGap) gaps.emplace_back(gap, i);
  }
  std::sort(gaps.begin(), gaps.end());
  std::vector<bool> joins(parts.size());
  std::uint64_t budget = std::max(kFreeGaps, needed / kGapShare);
  for (const auto& [gap, after] : gaps) {
    if (gap > kSmallGap) {
      if (gap > budget) break;
      budget -= gap;
    }
    joins[after] = true;
  }
  std::vector<BytePart> out;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    BytePart part = parts[i];
    for (; i + 1 < parts.size() && joins[i + 1]; ++i) {
      part.bytes = end_of(parts[i + 1]) - part.offset;
    }
    for (; part.bytes > kMaxPart; part = {part.offset + kMaxPart, part.bytes - kMaxPart}) {
      out.push_back({part.offset, kMaxPart});
    }
    out.push_back(part);
  }
  return out;
}

}  // namespace terrace::stream::net
