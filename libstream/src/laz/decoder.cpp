// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "laz/coder.hpp"
#include "laz/layered.hpp"
#include "laz/layout.hpp"
#include "laz/pointwise_chunk.hpp"
#include "terrace/stream/laz.hpp"

namespace terrace::stream::laz {
namespace {

using Bytes = std::span<const std::uint8_t>;

Bytes bytes_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

/// Returns the attribute in a layer; the first layer is always decoded.
std::uint32_t attribute_of(std::size_t layer, const RecordLayout& layout) {
  constexpr std::uint32_t kPointAttributes[kItemLayers] = {
      kAllAttributes, kZ,        kClassification, kFlags,  kIntensity,
      kScanAngle,     kUserData, kPointSource,    kGpsTime};
  if (layer < kItemLayers) return kPointAttributes[layer];
  layer -= kItemLayers;
  if (layout.rgb != 0 && layer-- == 0) return kRgb;
  if (layout.nir != 0 && layer-- == 0) return kNir;
  if (layout.wave_packet != 0 && layer-- == 0) return kWavePacket;
  return kExtraByte0 << std::min<std::size_t>(layer, 15);
}

/// Bytes before the layers of a chunk: the first record, the number of points, the layers' sizes.
std::size_t head_size(const RecordLayout& layout) {
  return layout.length + sizeof(std::uint32_t) * (1 + layer_count(layout));
}

Chunk chunk_of(const RecordLayout& layout, Bytes head) {
  if (head.size() < head_size(layout)) throw Corrupt("the chunk is too short", head.size());
  Chunk chunk{.bytes = head_size(layout),
              .points = load<std::uint32_t>(head.data() + layout.length)};
  for (std::size_t at = layout.length + 4; at < head_size(layout); at += 4) {
    chunk.bytes += load<std::uint32_t>(head.data() + at);
  }
  return chunk;
}

}  // namespace

std::size_t layered_head_size(const Vlr& vlr) { return head_size(layout_of(vlr)); }

Chunk layered_chunk(const Vlr& vlr, std::span<const std::byte> head) {
  return chunk_of(layout_of(vlr), bytes_of(head));
}

struct Decoder::Impl {
  Impl(const Vlr& vlr, std::uint32_t attribute_mask)
      : layout(layout_of(vlr)), attributes(attribute_mask) {
    if (vlr.compressor == Compressor::layered) {
      layered = std::make_unique<Layered<SymbolDecoder>>(layout);
      coded.resize(layered->coders.size());
    } else {
      pointwise = std::make_unique<Pointwise<SymbolDecoder>>(layout);
      coded.resize(1);
    }
  }

  RecordLayout layout;
  std::uint32_t attributes;
  std::unique_ptr<Pointwise<SymbolDecoder>> pointwise;
  std::unique_ptr<Layered<SymbolDecoder>> layered;
  std::vector<CodedBytes> coded;  ///< of the layers, or of the one stream
  ChunkNumber chunk = 0;
  std::uint64_t points = 0, remaining = 0;  ///< of the chunk
  std::uint64_t consumed = 0;               ///< bytes of it in earlier steps
  std::size_t chunk_bytes = 0;              ///< of a layered chunk

  Step step_pointwise(Bytes bytes, bool last, std::uint8_t* records, std::size_t room);
  Step step_layered(Bytes bytes, bool last, std::uint8_t* records, std::size_t room);
  void begin_layers(Bytes bytes);
};

Decoder::Decoder(const Vlr& vlr, std::uint32_t attributes)
    : impl_(std::make_unique<Impl>(vlr, attributes)) {}
Decoder::~Decoder() = default;
Decoder::Decoder(Decoder&&) noexcept = default;
Decoder& Decoder::operator=(Decoder&&) noexcept = default;

void Decoder::start(std::uint64_t points) {
  impl_->points = impl_->remaining = points;
  impl_->consumed = 0;
  ++impl_->chunk;
}

Decoder::Step Decoder::step(std::span<const std::byte> bytes, bool last,
                            std::span<std::byte> records) {
  Impl& impl = *impl_;
  const auto room = static_cast<std::size_t>(
      std::min<std::uint64_t>(records.size() / impl.layout.length, impl.remaining));
  if (room == 0) return {};
  auto* out = reinterpret_cast<std::uint8_t*>(records.data());
  const Step step = impl.layered != nullptr ? impl.step_layered(bytes_of(bytes), last, out, room)
                                            : impl.step_pointwise(bytes_of(bytes), last, out, room);
  impl.remaining -= step.points;
  impl.consumed += step.bytes;
  return step;
}

void Decoder::decode_chunk(std::span<const std::byte> chunk, std::span<std::byte> records) {
  start(records.size() / impl_->layout.length);
  const Step done = step(chunk, true, records);
  if (done.bytes < chunk.size())
    throw Corrupt("bytes follow the last point of the chunk", done.bytes);
}

Decoder::Step Decoder::Impl::step_pointwise(Bytes bytes, bool last, std::uint8_t* records,
                                            std::size_t room) {
  SymbolDecoder& coder = pointwise->coder;
  Step step;
  if (remaining == points) {
    if (bytes.size() < layout.length + kStreamEnds) {
      if (last) throw Corrupt("the chunk is too short", bytes.size());
      return {};
    }
    std::memcpy(records, bytes.data(), layout.length);
    pointwise->begin(records);
    coder.begin(coded[0], bytes.subspan(layout.length), layout.length, chunk);
    step = {.bytes = layout.length, .points = 1};
  } else {
    coder.resume(coded[0], bytes, consumed);
  }
  step.points += pointwise->code(records + step.points * layout.length, room - step.points, !last);
  coder.check_used(true);
  step.bytes += coder.offset();
  return step;
}

void Decoder::Impl::begin_layers(Bytes bytes) {
  std::size_t begin = head_size(layout);
  for (std::size_t i = 0; i < layered->coders.size(); ++i) {
    const auto size = load<std::uint32_t>(bytes.data() + layout.length + 4 + 4 * i);
    auto& layer = layered->coders[i];
    const bool selected = i == kXyLayer || (attributes & attribute_of(i, layout)) != 0;
    layer.used = size > 0 && selected;
    if (layer.used) layer.coder.begin(coded[i], bytes.subspan(begin, size), begin, chunk);
    begin += size;
  }
  chunk_bytes = begin;
  if (points > 1 && !layered->coders[kXyLayer].used) {
    throw Corrupt("the chunk's first layer is missing", layout.length + 4);
  }
}

Decoder::Step Decoder::Impl::step_layered(Bytes bytes, bool last, std::uint8_t* records,
                                          std::size_t room) {
  Step step;
  if (remaining == points) {
    if (!last && bytes.size() < head_size(layout)) return {};
    const Chunk head = chunk_of(layout, bytes);
    if (head.bytes > bytes.size()) {
      if (last) throw Corrupt("the chunk's layers are longer than the chunk", bytes.size());
      return {};
    }
    if (head.points != points) {
      throw Corrupt(fmt::format("the chunk has {} points, not {}", head.points, points),
                    layout.length);
    }
    begin_layers(bytes);
    std::memcpy(records, bytes.data(), layout.length);
    layered->begin(records);
    step.points = 1;
  }
  layered->code(records + step.points * layout.length, room - step.points);
  step.points = room;
  if (room == remaining) {
    for (const auto& layer : layered->coders) {
      if (layer.used) layer.coder.check_used(false);
    }
    step.bytes = chunk_bytes;
  }
  return step;
}

}  // namespace terrace::stream::laz
