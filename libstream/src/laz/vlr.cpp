// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>

#include <fmt/core.h>

#include "laz/bytes.hpp"
#include "laz/layout.hpp"
#include "terrace/stream/laz.hpp"

namespace terrace::stream::laz {
namespace {

// Offsets of the payload's fields in bytes.
constexpr std::size_t kCompressorAt = 0, kCoderAt = 2, kVersionAt = 4, kOptionsAt = 8,
                      kChunkSizeAt = 12, kSpecialAt = 16, kItemCountAt = 32, kItemsAt = 34;
constexpr std::size_t kItemSize = 6;

/// Returns the items of a point format without extra bytes, in their usual version.
std::vector<Item> standard_items(unsigned point_format) {
  using enum ItemType;
  constexpr Item kPoint10{point10, 20, 2}, kTime{gps_time11, 8, 2}, kRgb12{rgb12, 6, 2},
      kWave13{wave_packet13, 29, 1}, kPoint14{point14, 30, 3}, kRgb14{rgb14, 6, 3},
      kRgbNir14{rgb_nir14, 8, 3}, kWave14{wave_packet14, 29, 3};
  switch (point_format) {
    case 0:
      return {kPoint10};
    case 1:
      return {kPoint10, kTime};
    case 2:
      return {kPoint10, kRgb12};
    case 3:
      return {kPoint10, kTime, kRgb12};
    case 4:
      return {kPoint10, kTime, kWave13};
    case 5:
      return {kPoint10, kTime, kRgb12, kWave13};
    case 6:
      return {kPoint14};
    case 7:
      return {kPoint14, kRgb14};
    case 8:
      return {kPoint14, kRgbNir14};
    case 9:
      return {kPoint14, kWave14};
    case 10:
      return {kPoint14, kRgbNir14, kWave14};
    default:
      throw std::invalid_argument(fmt::format("unknown point format {}", point_format));
  }
}

/// Whether these are the items of a point format, with or without extra bytes, in any version.
bool match_format(const std::vector<Item>& items, unsigned point_format) {
  const std::vector<Item> standard = standard_items(point_format);
  const std::size_t count = standard.size();
  if (items.size() != count && items.size() != count + 1) return false;
  const auto same = [](const Item& a, const Item& b) {
    return a.type == b.type && a.size == b.size;
  };
  if (!std::equal(standard.begin(), standard.end(), items.begin(), same)) return false;
  const ItemType extra = point_format < 6 ? ItemType::byte : ItemType::byte14;
  return items.size() == count || (items[count].type == extra && items[count].size > 0);
}

/// Version 2 of layered items was a prototype of version 3.
unsigned version_of(const Item& item) {
  return item.type >= ItemType::point14 ? std::max<unsigned>(item.version, 3) : item.version;
}

}  // namespace

Vlr Vlr::of(unsigned point_format, std::size_t record_length, std::uint32_t chunk_size) {
  Vlr vlr;
  vlr.items = standard_items(point_format);
  const std::size_t standard = vlr.record_length();
  if (record_length < standard || record_length > 0xffff) {
    throw std::invalid_argument(fmt::format("point format {} does not have records of {} bytes",
                                            point_format, record_length));
  }
  if (record_length > standard) {
    const auto extra = static_cast<std::uint16_t>(record_length - standard);
    vlr.items.push_back(point_format < 6 ? Item{ItemType::byte, extra, 2}
                                         : Item{ItemType::byte14, extra, 3});
  }
  vlr.compressor = point_format < 6 ? Compressor::pointwise_chunked : Compressor::layered;
  vlr.chunk_size = chunk_size;
  return vlr;
}

Vlr Vlr::parse(std::span<const std::byte> payload, unsigned point_format,
               std::size_t record_length) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(payload.data());
  if (payload.size() < kItemsAt) throw Corrupt("the LASzip VLR is too short", payload.size());
  Vlr vlr;
  const auto compressor = load<std::uint16_t>(bytes + kCompressorAt);
  if (compressor > 3) {
    throw Corrupt(fmt::format("LASzip's compressor {} is unknown", compressor), kCompressorAt);
  }
  vlr.compressor = static_cast<Compressor>(compressor);
  if (load<std::uint16_t>(bytes + kCoderAt) != 0) {
    throw Corrupt("LASzip's coder is not the arithmetic coder", kCoderAt);
  }
  vlr.options = load<std::uint32_t>(bytes + kOptionsAt);
  vlr.chunk_size = load<std::uint32_t>(bytes + kChunkSizeAt);
  if (vlr.chunk_size == 0) vlr.chunk_size = kVariable;
  const std::size_t count = load<std::uint16_t>(bytes + kItemCountAt);
  if (payload.size() < kItemsAt + count * kItemSize) {
    throw Corrupt("the LASzip VLR is too short", payload.size());
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* at = bytes + kItemsAt + i * kItemSize;
    vlr.items.push_back({static_cast<ItemType>(load<std::uint16_t>(at)),
                         load<std::uint16_t>(at + 2), load<std::uint16_t>(at + 4)});
  }
  if (point_format > 10 || !match_format(vlr.items, point_format) ||
      vlr.record_length() != record_length) {
    throw Corrupt("LASzip's items are not those of the point format and record length",
                  kItemCountAt);
  }
  try {
    if (vlr.compressor != Compressor::none) (void)layout_of(vlr);
  } catch (const std::invalid_argument& error) {
    throw Corrupt(error.what(), kItemCountAt);
  }
  return vlr;
}

std::vector<std::byte> Vlr::serialise() const {
  std::vector<std::byte> payload(kItemsAt + items.size() * kItemSize);
  auto* bytes = reinterpret_cast<std::uint8_t*>(payload.data());
  store(bytes + kCompressorAt, compressor);
  // The version of LASzip that writes the same bytes.
  bytes[kVersionAt] = 3;
  bytes[kVersionAt + 1] = 4;
  store(bytes + kOptionsAt, options);
  store(bytes + kChunkSizeAt, chunk_size);
  std::fill(bytes + kSpecialAt, bytes + kItemCountAt, std::uint8_t{0xff});  // no special EVLRs
  store(bytes + kItemCountAt, static_cast<std::uint16_t>(items.size()));
  std::uint8_t* at = bytes + kItemsAt;
  for (const Item& item : items) {
    store(at, item.type);
    store(at + 2, item.size);
    store(at + 4, item.version);
    at += kItemSize;
  }
  return payload;
}

std::size_t Vlr::record_length() const {
  std::size_t length = 0;
  for (const Item& item : items) length += item.size;
  return length;
}

RecordLayout layout_of(const Vlr& vlr) {
  using enum ItemType;
  const auto require = [](bool good, const char* cause) {
    if (!good) throw std::invalid_argument(cause);
  };
  const bool layered = vlr.compressor == Compressor::layered;
  require(vlr.compressor != Compressor::none, "the records are not compressed");
  unsigned point_format = layered ? 6 : 0;
  const unsigned last_format = layered ? 10 : 5;
  while (point_format <= last_format && !match_format(vlr.items, point_format)) ++point_format;
  require(point_format <= last_format, "LASzip's items are not those of its compressor");

  RecordLayout layout;
  layout.version = version_of(vlr.items.front());
  for (const Item& item : vlr.items) {
    const std::size_t at = layout.length;
    layout.length += item.size;
    if (item.type == gps_time11) layout.gps_time = at;
    if (item.type == rgb12 || item.type == rgb14 || item.type == rgb_nir14) layout.rgb = at;
    if (item.type == rgb_nir14) layout.nir = at + 6;
    if (item.type == wave_packet13 || item.type == wave_packet14) layout.wave_packet = at;
    if (item.type == byte || item.type == byte14) {
      layout.extra = at;
      layout.extra_bytes = item.size;
    }
    const unsigned version = version_of(item);
    require(layered ? version <= 4 : version == 1 || version == 2,
            "a LASzip item has an unknown version");
    require(version == layout.version || item.type == wave_packet13,
            "LASzip's items have different versions");
  }
  return layout;
}

}  // namespace terrace::stream::laz
