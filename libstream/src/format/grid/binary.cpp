// SPDX-License-Identifier: Apache-2.0
#include "format/grid/binary.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "format/raster_points.hpp"
#include "format/registry.hpp"
#include "format/sidecars.hpp"
#include "io/text.hpp"

namespace terrace::stream {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxHeaderBytes = 64u << 10;

std::string text_of(const fs::path& path) {
  const std::unique_ptr<ByteSource> bytes = open_file(path);
  if (bytes->size() > kMaxHeaderBytes) {
    throw grid_fault(path.string(), "is not the header of a grid: it is longer than 64 KiB");
  }
  std::string text(bytes->size(), '\0');
  bytes->read(0, std::as_writable_bytes(std::span(text)));
  return text;
}

ScalarType sample_type_of(const GridHeader& header, bool floats) {
  const std::uint64_t bits = header.count("nbits", floats ? 32 : 8);
  const std::string kind = lower_case(header.text("pixeltype"));
  const bool has_floats = kind.empty() ? floats : kind.starts_with('f');
  // Without a pixel type, a negative nodata value shows that the integers are signed.
  const auto has_negative_nodata = [&] {
    return NodataRule::parse(header.text("nodata"), ScalarType::f64).value.value_or(0) < 0;
  };
  const bool is_signed =
      kind.empty() ? !has_floats && has_negative_nodata() : kind.starts_with('s');
  if (has_floats && bits == 32) return ScalarType::f32;
  if (has_floats && bits == 64) return ScalarType::f64;
  if (!has_floats && bits == 8) return is_signed ? ScalarType::i8 : ScalarType::u8;
  if (!has_floats && bits == 16) return is_signed ? ScalarType::i16 : ScalarType::u16;
  if (!has_floats && bits == 32) return is_signed ? ScalarType::i32 : ScalarType::u32;
  throw header
      .fault(fmt::format("is {}{}, which is not supported", bits, has_floats ? " for floats" : ""))
      .at("nbits")
      .remedy("convert it: gdal_translate FILE out.tif");
}

std::endian order_of(const GridHeader& header) {
  const std::string order = lower_case(header.text("byteorder"));
  if (order.empty()) return std::endian::native;
  if (order.starts_with('i') || order.starts_with('l')) return std::endian::little;
  if (order.starts_with('m')) return std::endian::big;
  throw header.fault("is " + in_quotes(order) + ", neither I (LSBFIRST) nor M (MSBFIRST)")
      .at("byteorder");
}

/// Returns the product of two sizes. Throws: Error if it is too large, because headers may claim
/// anything.
std::uint64_t product(const GridHeader& header, const std::string& key, std::uint64_t a,
                      std::uint64_t b) {
  if (b != 0 && a > (std::uint64_t{1} << 62) / b) throw header.fault("is too large").at(key);
  return a * b;
}

std::unique_ptr<PointSource> open_binary_points(std::span<const std::string> files,
                                                const SourceOptions& options) {
  return open_raster_points(files, options, &open_binary_grid);
}

/// The bytes are plain samples, so only the name shows the format.
bool recognise_nothing(std::span<const std::byte>) { return false; }

}  // namespace

fs::path binary_header_of(const std::string& file) {
  for (const char* ending : {".hdr", ".HDR"}) {
    fs::path path = fs::path(file).replace_extension(ending);
    std::error_code ignored;
    if (fs::is_regular_file(path, ignored)) return path;
  }
  return {};
}

GridHeader read_binary_header(const std::string& file, std::string_view text) {
  GridHeader header(file);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    const auto fields = split_fields(text.substr(0, end), ' ');
    if (fields.size() >= 2) header.set(fields[0], fields[1]);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  // Both spellings are common.
  if (header.has("nodata_value")) header.set("nodata", header.text("nodata_value"));
  return header;
}

PlainGrid describe_binary_grid(const std::string& file, const GridHeader& header, bool floats,
                               int band) {
  const ScalarType type = sample_type_of(header, floats);
  const std::uint64_t size = size_of(type);
  const std::uint64_t columns = header.count("ncols"), rows = header.count("nrows");
  PlainGrid grid = plain_grid("binary-grid", file, columns, rows, type, header.text("nodata"));
  grid.order = order_of(header);
  grid.first = header.count("skipbytes", 0);

  constexpr std::uint64_t kMaxBands = 65535;
  const std::uint64_t bands = header.count("nbands", 1);
  if (bands == 0 || bands > kMaxBands)
    throw header.fault("is not between 1 and 65535").at("nbands");
  check_band(file, band, bands);
  const auto before = static_cast<std::uint64_t>(band - 1);
  const std::string layout = lower_case(header.text("layout"));
  std::uint64_t band_start = 0;
  if (layout == "bip") {
    grid.sample_step = bands;
    grid.row_bytes = header.count("totalrowbytes", columns * bands * size);
    band_start = before * size;
  } else if (layout == "bsq") {
    grid.row_bytes = header.count("totalrowbytes", columns * size);
    const std::uint64_t band_bytes = product(header, "totalrowbytes", grid.row_bytes, rows);
    const std::uint64_t gap = header.count("bandgapbytes", 0);
    band_start = product(header, "bandgapbytes", before, band_bytes + gap);
  } else if (layout == "bil" || layout.empty()) {
    const std::uint64_t band_row = header.count("bandrowbytes", columns * size);
    grid.row_bytes =
        header.count("totalrowbytes", product(header, "bandrowbytes", bands, band_row));
    band_start = product(header, "bandrowbytes", before, band_row);
  } else {
    throw header.fault("is " + in_quotes(layout) + ", not BIL, BIP or BSQ").at("layout");
  }
  if (grid.row_bytes < ((columns - 1) * grid.sample_step + 1) * size) {
    throw header.fault("is less than the size of a row").at("totalrowbytes");
  }
  grid.first += band_start;
  grid.info.world = header.world(rows, grid.info.comments);
  return grid;
}

std::unique_ptr<Raster> open_binary_grid(const std::string& file, const RasterOptions& options) {
  const fs::path header_file = binary_header_of(file);
  if (header_file.empty()) {
    throw grid_fault(file, "has no header file next to it (.hdr)")
        .remedy("download that too: it has the size, type and place of the grid");
  }
  const GridHeader header = read_binary_header(header_file.string(), text_of(header_file));
  const bool floats = lower_case(fs::path(file).extension().string()) == ".flt";
  PlainGrid grid = describe_binary_grid(file, header, floats, options.band);
  if (options.nodata) set_nodata(*options.nodata, grid);
  place_by_world_file(file, grid.info);
  return open_plain_grid(std::move(grid), open_file(file));
}

const Format& binary_grid_format() {
  static const Format format{.name = "binary-grid",
                             .endings = {".flt", ".bil", ".bip", ".bsq"},
                             .recognise = &recognise_nothing,
                             .open = &open_binary_points,
                             .raster = true};
  return format;
}

}  // namespace terrace::stream
