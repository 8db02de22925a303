// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <stdexcept>
#include <vector>

#include "laz/coder.hpp"
#include "laz/layered.hpp"
#include "laz/layout.hpp"
#include "laz/pointwise_chunk.hpp"
#include "terrace/stream/laz.hpp"

namespace terrace::stream::laz {

struct Encoder::Impl {
  explicit Impl(const Vlr& vlr) : layout(layout_of(vlr)) {
    if (vlr.compressor == Compressor::layered) {
      layered = std::make_unique<Layered<SymbolEncoder>>(layout);
      coded.resize(layered->coders.size());
    } else {
      pointwise = std::make_unique<Pointwise<SymbolEncoder>>(layout);
      coded.resize(1);
    }
  }

  RecordLayout layout;
  std::unique_ptr<Pointwise<SymbolEncoder>> pointwise;
  std::unique_ptr<Layered<SymbolEncoder>> layered;
  std::vector<std::vector<std::uint8_t>> coded;  ///< the layers, or the one stream
  ChunkNumber chunk = 0;
};

Encoder::Encoder(const Vlr& vlr) : impl_(std::make_unique<Impl>(vlr)) {}
Encoder::~Encoder() = default;
Encoder::Encoder(Encoder&&) noexcept = default;
Encoder& Encoder::operator=(Encoder&&) noexcept = default;

void Encoder::encode_chunk(std::span<const std::byte> records, std::vector<std::byte>& out) {
  Impl& impl = *impl_;
  const std::size_t length = impl.layout.length, count = records.size() / length;
  if (count == 0 || records.size() % length != 0 || count > 0xffffffff) {
    throw std::invalid_argument("a chunk needs 1 to 2^32 - 1 complete records");
  }
  const auto* first = reinterpret_cast<const std::uint8_t*>(records.data());
  const auto append = [&out](const void* bytes, std::size_t size) {
    const auto* begin = static_cast<const std::byte*>(bytes);
    out.insert(out.end(), begin, begin + size);
  };
  append(first, length);
  ++impl.chunk;
  if (impl.pointwise != nullptr) {
    SymbolEncoder& coder = impl.pointwise->coder;
    coder.begin(impl.coded[0], impl.chunk);
    impl.pointwise->begin(first);
    impl.pointwise->code(first + length, count - 1, false);
    coder.finish();
    append(impl.coded[0].data(), impl.coded[0].size());
    return;
  }
  auto& layers = impl.layered->coders;
  for (std::size_t i = 0; i < layers.size(); ++i) layers[i].coder.begin(impl.coded[i], impl.chunk);
  impl.layered->begin(first);
  impl.layered->code(first + length, count - 1);
  const auto points = static_cast<std::uint32_t>(count);
  append(&points, sizeof points);
  for (std::size_t i = 0; i < layers.size(); ++i) {
    layers[i].coder.finish();
    if (!layers[i].used) impl.coded[i].clear();
    if (impl.coded[i].size() > 0xffffffff) {
      throw std::invalid_argument("a layer of a chunk has more than 4 GiB");
    }
    const auto size = static_cast<std::uint32_t>(impl.coded[i].size());
    append(&size, sizeof size);
  }
  for (const auto& layer : impl.coded) append(layer.data(), layer.size());
}

}  // namespace terrace::stream::laz
