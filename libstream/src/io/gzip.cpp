// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/gzip.hpp"

#include <cassert>
#include <memory>
#include <new>

#include <fmt/core.h>
#include <libdeflate.h>

#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

struct Deleter {
  void operator()(libdeflate_compressor* c) const { libdeflate_free_compressor(c); }
  void operator()(libdeflate_decompressor* d) const { libdeflate_free_decompressor(d); }
};

Error gzip_error(const std::string& name, std::string cause) {
  return Error(name, std::move(cause)).at("gzip").remedy("recreate the file");
}

// Returns the size of the decompressed bytes modulo 2^32, which the last four bytes state.
std::uint64_t stated_size(std::span<const std::byte> bytes) {
  std::uint64_t size = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    size |= std::to_integer<std::uint64_t>(bytes[bytes.size() - 4 + i]) << (8 * i);
  }
  return size;
}

// The header has at least 10 bytes, the trailer 8.
constexpr std::size_t kMinBytes = 18;

}  // namespace

bool is_gzip(std::span<const std::byte> bytes) {
  return bytes.size() >= 2 && bytes[0] == std::byte{0x1F} && bytes[1] == std::byte{0x8B};
}

std::vector<std::byte> gzip(std::span<const std::byte> bytes, int level) {
  assert(level >= 1 && level <= 12);
  const std::unique_ptr<libdeflate_compressor, Deleter> compressor(
      libdeflate_alloc_compressor(level));
  if (!compressor) throw std::bad_alloc();
  std::vector<std::byte> out(libdeflate_gzip_compress_bound(compressor.get(), bytes.size()));
  const std::size_t size = libdeflate_gzip_compress(compressor.get(), bytes.data(), bytes.size(),
                                                    out.data(), out.size());
  assert(size != 0);
  out.resize(size);
  return out;
}

std::vector<std::byte> gunzip(std::span<const std::byte> bytes, std::uint64_t max_bytes,
                              const std::string& name) {
  if (!is_gzip(bytes) || bytes.size() < kMinBytes) throw gzip_error(name, "not gzip, or truncated");
  const std::uint64_t size = stated_size(bytes);
  if (size > max_bytes) {
    throw gzip_error(name, fmt::format("states {}, more than the limit of {}",
                                       counted(size, "byte"), max_bytes));
  }
  const std::unique_ptr<libdeflate_decompressor, Deleter> decompressor(
      libdeflate_alloc_decompressor());
  if (!decompressor) throw std::bad_alloc();
  std::vector<std::byte> out(size);
  std::size_t consumed = 0, produced = 0;
  const libdeflate_result result = libdeflate_gzip_decompress_ex(
      decompressor.get(), bytes.data(), bytes.size(), out.data(), out.size(), &consumed, &produced);
  if (result != LIBDEFLATE_SUCCESS || produced != size || consumed != bytes.size()) {
    throw gzip_error(name, "damaged: the contents do not match their checksum and size");
  }
  return out;
}

}  // namespace terrace::stream
