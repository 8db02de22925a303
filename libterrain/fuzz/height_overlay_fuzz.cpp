// SPDX-License-Identifier: Apache-2.0
// An overlay of a small store: the bytes of its header, its pages and its directory. The checksums
// are computed here, because a fuzzer cannot guess them.
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <vector>

#include <terrace/stream/overlay.hpp>
#include <terrace/stream/store.hpp>

#include "fuzz_target.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/detail_mesh.hpp"

namespace terrace::terrain::fuzz {

namespace {

/// 40 points in clusters, rebuilt in every run; the store's exact bytes do not matter.
const stream::Store& small_store() {
  static const ScratchFolder folder;
  static const stream::Store store = [] {
    const std::filesystem::path points = folder.path() / "points.xyz", path = folder.path() / "s";
    std::ofstream out(points);
    for (int i = 0; i < 40; ++i) out << i % 8 << ' ' << i / 8 << ' ' << i * i % 7 << '\n';
    out.close();
    BuildRequest request;
    request.inputs = {points.string()};
    request.store = path;
    request.block_points = 10;
    build_store(request);
    return stream::Store::open(path);
  }();
  return store;
}

std::uint32_t crc32(std::string_view bytes) {
  std::uint32_t crc = ~0u;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xEDB88320u : 0u);
  }
  return ~crc;
}

template <class T>
void put(std::string& bytes, T value, std::size_t at) {
  if (at + sizeof value <= bytes.size()) std::memcpy(bytes.data() + at, &value, sizeof value);
}

template <class T>
T get(const std::string& bytes, std::size_t at) {
  T value{};
  if (at + sizeof value <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

/// Corrects the checksums of an overlay, see FORMAT.md. The mark has 16 bytes; then follow the
/// version, the store's checksum, the number of pages, the end of the pages, and the length of the
/// name.
constexpr std::size_t kStoreAt = 20, kCountAt = 24, kEndAt = 32, kNameAt = 40, kHead = 44,
                      kEntry = 20;

void mend(std::string& bytes) {
  if (bytes.size() < kHead) return;
  put(bytes, small_store().checksum(), kStoreAt);
  const std::uint64_t name = get<std::uint32_t>(bytes, kNameAt);
  if (kHead + name + 4 > bytes.size()) return;
  put(bytes, crc32(std::string_view(bytes).substr(0, kHead + name)), kHead + name);
  const auto end = get<std::uint64_t>(bytes, kEndAt), count = get<std::uint64_t>(bytes, kCountAt);
  if (end > bytes.size() - 4 || count > bytes.size() / kEntry ||
      end + count * kEntry + 4 != bytes.size()) {
    return;
  }
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto begin = get<std::uint64_t>(bytes, end + i * kEntry + 8);
    const auto next = i + 1 < count ? get<std::uint64_t>(bytes, end + (i + 1) * kEntry + 8) : end;
    if (begin + 4 > next || next > end || begin > end) continue;
    put(bytes, crc32(std::string_view(bytes).substr(begin, next - 4 - begin)), next - 4);
  }
  put(bytes, crc32(std::string_view(bytes).substr(end, count * kEntry)), bytes.size() - 4);
}

}  // namespace

bool accepts(const std::uint8_t* data, std::size_t size) {
  std::string bytes(text_of(data, size));
  mend(bytes);
  const MemoryFile file(bytes);
  const stream::Store& store = small_store();
  try {
    stream::Overlay overlay = open_height_overlay(file.name(), store);
    std::uint64_t values = 0;
    overlay.for_each([&](stream::ClusterId id, std::span<const stream::OverlayValue> list) {
      require(!list.empty(), "a cluster with values has some");
      stream::ClusterPoints points;
      store.read(id, points);
      for (const stream::OverlayValue& value : list) {
        require(std::isfinite(value.value), "heights are finite");
        if (value.index >= points.size()) continue;  // users of an overlay skip these
      }
      values += list.size();
    });
    require(values == overlay.values(), "as many values as announced");
    return true;
  } catch (const stream::Error& error) {
    require(!error.parts().cause.empty(), "a cause");
    return false;
  }
}

}  // namespace terrace::terrain::fuzz
