// SPDX-License-Identifier: Apache-2.0
#include "format/grid/unpack.hpp"

#include <algorithm>
#include <array>
#include <new>
#include <span>
#include <vector>

#include <fmt/core.h>
#include <zip.h>
#include <zlib.h>

#include "format/grid/plain_grid.hpp"
#include "io/spool.hpp"
#include "io/text.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kUnpackBytes = 256u << 10;
/// Throws: Error beyond the growth of Deflate. Other methods of zip archives compress flat ground
/// even better, but no elevation grid needs that.
void check_growth(const std::string& file, const std::string& where, std::uint64_t packed,
                  std::uint64_t unpacked) {
  if (unpacked / kDeflateGrowth <= packed) return;
  throw grid_fault(file, fmt::format("states {}, too many for {}", counted(unpacked, "byte"),
                                     counted(packed, "packed byte")))
      .at(where);
}

/// Collects unpacked bytes, never more than stated.
class Unpacked {
 public:
  Unpacked(const std::string& file, const PackedFile& packed)
      : file_(file), packed_(packed), spool_(std::make_unique<Spool>(file)) {}

  void append(std::span<const std::byte> bytes) {
    if (bytes.size() > packed_.size - spool_->size()) throw differs("more");
    spool_->append(bytes);
  }
  std::unique_ptr<ByteSource> take() {
    if (spool_->size() != packed_.size) throw differs("fewer");
    return std::move(spool_);
  }

 private:
  [[nodiscard]] Error differs(const char* relation) const {
    return grid_fault(file_, fmt::format("unpacks to {} than the {} that it states", relation,
                                         counted(packed_.size, "byte")))
        .at(packed_.name);
  }

  const std::string& file_;
  const PackedFile& packed_;
  std::unique_ptr<Spool> spool_;
};

}  // namespace

ZipArchive::ZipArchive(const std::string& file) : file_(file) {
  int error = 0;
  archive_ = zip_open(file.c_str(), ZIP_RDONLY, &error);
  if (archive_ == nullptr) {
    zip_error_t reason;
    zip_error_init_with_code(&reason, error);
    const std::string text = zip_error_strerror(&reason);
    zip_error_fini(&reason);
    throw grid_fault(file, text).at("zip");
  }
}

ZipArchive::~ZipArchive() { zip_discard(archive_); }

std::vector<PackedFile> ZipArchive::find(std::string_view ending) const {
  std::vector<PackedFile> found;
  const auto files =
      static_cast<std::uint64_t>(std::max<zip_int64_t>(0, zip_get_num_entries(archive_, 0)));
  for (std::uint64_t number = 0; number < files; ++number) {
    zip_stat_t status;
    if (zip_stat_index(archive_, number, 0, &status) != 0) continue;
    constexpr zip_uint64_t kNeeded = ZIP_STAT_NAME | ZIP_STAT_SIZE | ZIP_STAT_COMP_SIZE;
    if ((status.valid & kNeeded) != kNeeded || !lower_case(status.name).ends_with(ending)) continue;
    // macOS packs a companion file with each file.
    if (std::string_view(status.name).starts_with("__MACOSX/")) continue;
    check_growth(file_, status.name, status.comp_size, status.size);
    found.push_back({.name = status.name, .size = status.size, .number = number});
  }
  if (found.empty()) {
    throw grid_fault(file_, fmt::format("has no {} file", ending))
        .remedy("unpack it: 'unzip FILE'");
  }
  return found;
}

std::unique_ptr<ByteSource> ZipArchive::unpack(const PackedFile& packed) const {
  zip_file_t* const member = zip_fopen_index(archive_, packed.number, 0);
  if (member == nullptr) {
    throw grid_fault(file_, zip_strerror(archive_)).at(packed.name).remedy("unpack it yourself");
  }
  struct Close {
    void operator()(zip_file_t* open) const { zip_fclose(open); }
  };
  const std::unique_ptr<zip_file_t, Close> close(member);
  Unpacked unpacked(file_, packed);
  std::vector<std::byte> piece(kUnpackBytes);
  for (;;) {
    const zip_int64_t got = zip_fread(member, piece.data(), piece.size());
    if (got < 0) {
      throw grid_fault(file_, zip_error_strerror(zip_file_get_error(member))).at(packed.name);
    }
    if (got == 0) return unpacked.take();
    unpacked.append({piece.data(), static_cast<std::size_t>(got)});
  }
}

PackedFile find_in_gzip(const std::string& file) {
  const std::unique_ptr<ByteSource> bytes = open_file(file);
  constexpr std::uint64_t kLeast = 18;  // a header of 10 bytes and a trailer of 8
  if (bytes->size() < kLeast) throw grid_fault(file, "is truncated").at("gzip");
  std::array<std::byte, 4> trailer{};
  bytes->read(bytes->size() - trailer.size(), trailer);
  PackedFile packed;
  for (std::size_t i = 0; i < trailer.size(); ++i) {
    packed.size |= std::to_integer<std::uint64_t>(trailer[i]) << (8 * i);
  }
  check_growth(file, "gzip", bytes->size(), packed.size);
  return packed;
}

std::unique_ptr<ByteSource> unpack_gzip(const std::string& file, const PackedFile& packed) {
  const std::unique_ptr<ByteSource> bytes = open_file(file);
  z_stream stream{};
  constexpr int kGzip = 16 + MAX_WBITS;
  if (inflateInit2(&stream, kGzip) != Z_OK) throw std::bad_alloc();
  struct End {
    void operator()(z_stream* open) const { inflateEnd(open); }
  };
  const std::unique_ptr<z_stream, End> end(&stream);
  Unpacked unpacked(file, packed);
  std::vector<std::byte> in(kUnpackBytes), out(kUnpackBytes);
  int state = Z_OK;
  for (std::uint64_t at = 0; state != Z_STREAM_END;) {
    if (stream.avail_in == 0) {
      const auto more =
          static_cast<std::size_t>(std::min<std::uint64_t>(in.size(), bytes->size() - at));
      if (more == 0) throw grid_fault(file, "is truncated").at("gzip");
      bytes->read(at, {in.data(), more});
      at += more;
      stream.next_in = reinterpret_cast<Bytef*>(in.data());
      stream.avail_in = static_cast<uInt>(more);
    }
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    state = inflate(&stream, Z_NO_FLUSH);
    if (state != Z_OK && state != Z_STREAM_END && state != Z_BUF_ERROR) {
      throw grid_fault(file,
                       fmt::format("is damaged: {}", stream.msg == nullptr ? "zlib" : stream.msg))
          .at("gzip");
    }
    unpacked.append({out.data(), out.size() - stream.avail_out});
  }
  return unpacked.take();
}

}  // namespace terrace::stream
