// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include <tiffio.h>

#include "format/geotiff/tags.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/geotiff_writer.hpp"

namespace terrace::stream {
namespace {

// libtiff wants names that are not const, but never writes to them.
char* name(const char* text) { return const_cast<char*>(text); }

const std::array<TIFFFieldInfo, 8> kFields{{
    {kModelPixelScale, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, name("ModelPixelScale")},
    {kModelTiepoint, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, name("ModelTiepoint")},
    {kModelTransformation, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, name("ModelTransformation")},
    {kGeoKeyDirectory, -1, -1, TIFF_SHORT, FIELD_CUSTOM, 1, 1, name("GeoKeyDirectory")},
    {kGeoDoubleParams, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, name("GeoDoubleParams")},
    {kGeoAsciiParams, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, name("GeoAsciiParams")},
    {kGdalMetadata, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, name("GDAL_METADATA")},
    {kGdalNodata, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, name("GDAL_NODATA")},
}};

/// The shortest text that reads back as the same number.
std::string shortest(double value) {
  if (std::isnan(value)) return "nan";
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '&':
        out += "&amp;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

/// Collects GeoKeys; they must be in ascending order.
class KeyDirectory {
 public:
  void add(std::uint16_t key, std::uint16_t value) { entries_.push_back({key, 0, 1, value}); }
  void add(std::uint16_t key, const std::string& text) {
    const auto at = static_cast<std::uint16_t>(ascii_.size());
    constexpr std::size_t kMost = 16384;
    ascii_ += text.substr(0, kMost) + "|";
    const auto length = static_cast<std::uint16_t>(ascii_.size() - at);
    entries_.push_back({key, static_cast<std::uint16_t>(kGeoAsciiParams), length, at});
  }
  void add(std::uint16_t key, const std::vector<double>& values) {
    const auto at = static_cast<std::uint16_t>(doubles_.size());
    doubles_.insert(doubles_.end(), values.begin(), values.end());
    entries_.push_back({key, static_cast<std::uint16_t>(kGeoDoubleParams),
                        static_cast<std::uint16_t>(values.size()), at});
  }
  /// As it stands: what measures something is a double, what names something a short.
  void add(const GeoKey& key) {
    const bool measures = key.key == 2053 || key.key == 2055 ||
                          (key.key >= 2057 && key.key <= 2062) ||
                          (key.key >= 3077 && key.key <= 3096);
    if (key.values.empty()) {
      add(key.key, key.text);
    } else if (measures) {
      add(key.key, key.values);
    } else {
      add(key.key, static_cast<std::uint16_t>(key.values.front()));
    }
  }
  [[nodiscard]] std::vector<std::uint16_t> shorts() const {
    std::vector<std::uint16_t> all{1, 1, 1, static_cast<std::uint16_t>(entries_.size())};
    for (const auto& entry : entries_) all.insert(all.end(), entry.begin(), entry.end());
    return all;
  }
  [[nodiscard]] const std::string& ascii() const { return ascii_; }
  [[nodiscard]] const std::vector<double>& doubles() const { return doubles_; }

 private:
  std::vector<std::array<std::uint16_t, 4>> entries_;
  std::vector<double> doubles_;
  std::string ascii_;
};

std::uint16_t unit_code(const std::string& unit) {
  if (unit == "metre") return 9001;
  if (unit == "foot") return 9002;
  if (unit == "US survey foot") return 9003;
  if (unit == "degree") return 9102;
  return 0;
}

KeyDirectory keys_of(const GeoTiffOptions& options) {
  const Crs& crs = options.crs;
  const auto code = [](int epsg) {
    return static_cast<std::uint16_t>(epsg > 0 && epsg < kUserDefined ? epsg : 0);
  };
  const std::uint16_t epsg = code(crs.epsg), unit = unit_code(crs.horizontal_unit);
  KeyDirectory keys;
  const std::span<const GeoKey> own =
      epsg == 0 ? std::span(crs.geo_keys) : std::span<const GeoKey>();
  if (epsg != 0) keys.add(kGTModelType, crs.geographic ? kModelGeographic : kModelProjected);
  for (const GeoKey& key : own) {
    if (key.key == kGTModelType) keys.add(key);
  }
  keys.add(kGTRasterType, options.pixel_is_point ? kPixelIsPoint : kPixelIsArea);
  if (!crs.name.empty()) keys.add(kGTCitation, crs.name);
  for (const GeoKey& key : own) {
    if (key.key > kGTCitation && key.key < kVerticalCrs) keys.add(key);
  }
  if (!own.empty() && !crs.geographic && unit != 0) keys.add(kLinearUnit, unit);
  if (epsg != 0 && crs.geographic) {
    keys.add(kGeodeticCrs, epsg);
    keys.add(kAngularUnit, unit != 0 ? unit : std::uint16_t{9102});
  } else if (epsg != 0) {
    keys.add(kProjectedCrs, epsg);
    if (unit != 0) keys.add(kLinearUnit, unit);
  }
  if (const std::uint16_t vertical = code(crs.vertical_epsg); vertical != 0) {
    keys.add(kVerticalCrs, vertical);
    const std::uint16_t vertical_unit = unit_code(crs.vertical_unit);
    if (vertical_unit != 0) keys.add(kVerticalUnit, vertical_unit);
  }
  return keys;
}

std::string metadata_of(const Channel& sample) {
  if (sample.scale == 1 && sample.offset == 0 && sample.unit.empty()) return {};
  std::string xml = "<GDALMetadata>\n";
  const auto item = [&](const char* item_name, const char* role, const std::string& value) {
    xml.append("  <Item name=\"").append(item_name).append("\" sample=\"0\" role=\"");
    xml.append(role).append("\">").append(value).append("</Item>\n");
  };
  if (sample.offset != 0) item("OFFSET", "offset", shortest(sample.offset));
  if (sample.scale != 1) item("SCALE", "scale", shortest(sample.scale));
  if (!sample.unit.empty()) item("UNITTYPE", "unittype", escaped(sample.unit));
  return xml + "</GDALMetadata>\n";
}

bool is_float(ScalarType type) { return type == ScalarType::f32 || type == ScalarType::f64; }

bool is_signed(ScalarType type) {
  return type == ScalarType::i8 || type == ScalarType::i16 || type == ScalarType::i32 ||
         type == ScalarType::i64;
}

}  // namespace

struct GeoTiffWriter::Impl {
  GeoTiffOptions options;
  AtomicFile file;
  std::uint64_t position = 0;
  std::exception_ptr failure;  // of the file, on its way through libtiff
  std::string complaint;
  TIFF* tiff = nullptr;
  std::vector<std::byte> band;  // a row of tiles, by rows
  std::vector<std::byte> tile;  // one of them
  std::uint32_t next_row = 0;   // of write_rows
  bool by_rows = false;

  Impl(const std::filesystem::path& path, const GeoTiffOptions& wanted)
      : options(wanted), file(path, wanted.replace) {}
  ~Impl() {
    if (tiff != nullptr) TIFFClose(tiff);
  }

  [[nodiscard]] std::size_t sample_bytes() const { return size_of(options.sample.type); }

  [[noreturn]] void fail(const std::string& what) {
    if (failure) std::rethrow_exception(std::exchange(failure, nullptr));
    throw Error({.file = file.target().string(),
                 .where = {},
                 .cause = what + (complaint.empty() ? "" : ": " + complaint),
                 .remedy = {}});
  }
  void check(int result, const char* what) {
    if (result == 0 || failure) fail(what);
  }

  void open();
  void set_fields();
  void set_georeference();
  void put_tile(std::uint32_t across, std::uint32_t down);
  void flush_band(std::uint32_t rows_there);

  // Exceptions do not pass through libtiff: they wait in `failure`.
  template <class F>
  static tmsize_t guarded(thandle_t handle, F&& f) {
    Impl& impl = *static_cast<Impl*>(handle);
    try {
      return f(impl);
    } catch (...) {
      if (!impl.failure) impl.failure = std::current_exception();
      return -1;
    }
  }
  static tmsize_t read(thandle_t handle, void* out, tmsize_t bytes) {
    return guarded(handle, [&](Impl& impl) {
      const std::span to(static_cast<std::byte*>(out), static_cast<std::size_t>(bytes));
      const std::size_t n = impl.file.read_at(impl.position, to);
      impl.position += n;
      return static_cast<tmsize_t>(n);
    });
  }
  static tmsize_t write(thandle_t handle, void* from, tmsize_t bytes) {
    return guarded(handle, [&](Impl& impl) {
      const std::span piece(static_cast<const std::byte*>(from), static_cast<std::size_t>(bytes));
      if (impl.position == impl.file.size()) {
        impl.file.write(piece);
      } else {
        impl.file.write_at(impl.position, piece);
      }
      impl.position += piece.size();
      return bytes;
    });
  }
  static toff_t seek(thandle_t handle, toff_t offset, int whence) {
    Impl& impl = *static_cast<Impl*>(handle);
    if (whence == SEEK_CUR) offset += impl.position;
    if (whence == SEEK_END) offset += impl.file.size();
    return impl.position = offset;
  }
  static int close(thandle_t) { return 0; }
  static toff_t size(thandle_t handle) { return static_cast<Impl*>(handle)->file.size(); }
  static int on_error(TIFF*, void* self, const char*, const char* format, va_list values) {
    auto& impl = *static_cast<Impl*>(self);
    std::array<char, 512> text{};
    std::vsnprintf(text.data(), text.size(), format, values);
    if (impl.complaint.empty()) impl.complaint = text.data();
    return 1;
  }
  static int on_warning(TIFF*, void*, const char*, const char*, va_list) { return 1; }
};

void GeoTiffWriter::Impl::open() {
  const std::uint64_t tiles = (std::uint64_t{options.columns} + options.tile - 1) / options.tile *
                              ((std::uint64_t{options.rows} + options.tile - 1) / options.tile);
  const std::uint64_t tile_bytes = std::uint64_t{options.tile} * options.tile * sample_bytes();
  // Compression may also make noise a little larger.
  const bool big = tiles > (UINT64_MAX >> 1) / (tile_bytes + 1024) ||
                   tiles * (tile_bytes + tile_bytes / 64 + 64) > 4'200'000'000;
  const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> open_options(
      TIFFOpenOptionsAlloc(), TIFFOpenOptionsFree);
  if (open_options != nullptr) {
    TIFFOpenOptionsSetErrorHandlerExtR(open_options.get(), on_error, this);
    TIFFOpenOptionsSetWarningHandlerExtR(open_options.get(), on_warning, this);
    tiff = TIFFClientOpenExt(file.target().c_str(), big ? "w8m" : "wm", this, read, write, seek,
                             close, size, nullptr, nullptr, open_options.get());
  }
  if (tiff == nullptr) fail("cannot be begun");
  TIFFMergeFieldInfo(tiff, kFields.data(), static_cast<std::uint32_t>(kFields.size()));
}

void GeoTiffWriter::Impl::set_fields() {
  const ScalarType type = options.sample.type;
  std::uint16_t compression = COMPRESSION_NONE;
  if (options.compression == GeoTiffCompression::deflate) compression = COMPRESSION_ADOBE_DEFLATE;
  if (options.compression == GeoTiffCompression::zstd) compression = COMPRESSION_ZSTD;
  if (TIFFIsCODECConfigured(compression) == 0) {
    throw Error({.file = file.target().string(),
                 .where = {},
                 .cause = "this system's libtiff cannot compress so",
                 .remedy = "choose another compression"});
  }
  const auto format = is_float(type)    ? SAMPLEFORMAT_IEEEFP
                      : is_signed(type) ? SAMPLEFORMAT_INT
                                        : SAMPLEFORMAT_UINT;
  check(TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, options.columns), "size");
  check(TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, options.rows), "size");
  check(TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * sample_bytes())), "type");
  check(TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1), "bands");
  check(TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, format), "type");
  check(TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK), "photometric");
  check(TIFFSetField(tiff, TIFFTAG_SOFTWARE, "terrace"), "software");
  check(TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG), "layout");
  check(TIFFSetField(tiff, TIFFTAG_TILEWIDTH, options.tile), "tile size");
  check(TIFFSetField(tiff, TIFFTAG_TILELENGTH, options.tile), "tile size");
  check(TIFFSetField(tiff, TIFFTAG_COMPRESSION, static_cast<int>(compression)), "compression");
  if (compression != COMPRESSION_NONE) {
    if (options.predictor) {
      const int predictor = is_float(type) ? PREDICTOR_FLOATINGPOINT : PREDICTOR_HORIZONTAL;
      check(TIFFSetField(tiff, TIFFTAG_PREDICTOR, predictor), "predictor");
    }
    const std::uint32_t level =
        compression == COMPRESSION_ZSTD ? TIFFTAG_ZSTD_LEVEL : TIFFTAG_ZIPQUALITY;
    check(TIFFSetField(tiff, level, options.level), "compression level");
  }
  const std::string metadata = metadata_of(options.sample);
  if (!metadata.empty()) check(TIFFSetField(tiff, kGdalMetadata, metadata.c_str()), "metadata");
  if (options.nodata) {
    check(TIFFSetField(tiff, kGdalNodata, shortest(*options.nodata).c_str()), "nodata");
  }
}

void GeoTiffWriter::Impl::set_georeference() {
  auto m = options.world.xy;
  if (!options.pixel_is_point) {  // to the corner of the cell
    m[2] -= 0.5 * (m[0] + m[1]);
    m[5] -= 0.5 * (m[3] + m[4]);
  }
  if (m[1] == 0 && m[3] == 0 && m[0] > 0 && m[4] < 0) {
    const std::array<double, 3> scale{m[0], -m[4], 0};
    const std::array<double, 6> tie{0, 0, 0, m[2], m[5], 0};
    check(TIFFSetField(tiff, kModelPixelScale, 3, scale.data()), "pixel scale");
    check(TIFFSetField(tiff, kModelTiepoint, 6, tie.data()), "tie point");
  } else {
    const std::array<double, 16> matrix{m[0], m[1], 0, m[2], m[3], m[4], 0, m[5],
                                        0,    0,    0, 0,    0,    0,    0, 1};
    check(TIFFSetField(tiff, kModelTransformation, 16, matrix.data()), "transformation");
  }
  const KeyDirectory keys = keys_of(options);
  const std::vector<std::uint16_t> shorts = keys.shorts();
  check(TIFFSetField(tiff, kGeoKeyDirectory, static_cast<int>(shorts.size()), shorts.data()),
        "GeoKeys");
  if (!keys.doubles().empty()) {
    check(TIFFSetField(tiff, kGeoDoubleParams, static_cast<int>(keys.doubles().size()),
                       keys.doubles().data()),
          "GeoKeys");
  }
  if (!keys.ascii().empty()) {
    check(TIFFSetField(tiff, kGeoAsciiParams, keys.ascii().c_str()), "GeoKeys");
  }
}

void GeoTiffWriter::Impl::put_tile(std::uint32_t across, std::uint32_t down) {
  complaint.clear();
  // libtiff encodes in place: the tile is scratch afterwards.
  const auto number = TIFFComputeTile(tiff, across * options.tile, down * options.tile, 0, 0);
  const tmsize_t written =
      TIFFWriteEncodedTile(tiff, number, tile.data(), static_cast<tmsize_t>(tile.size()));
  if (written < 0 || failure) {
    fail("tile " + std::to_string(across) + "," + std::to_string(down) + " cannot be written");
  }
}

/// Writes the band's tiles; what is beyond the raster repeats its edge, which costs least.
void GeoTiffWriter::Impl::flush_band(std::uint32_t rows_there) {
  const std::size_t size = sample_bytes(), side = options.tile;
  const std::size_t row_bytes = options.columns * size;
  const std::uint32_t down = (next_row - 1) / options.tile;
  const std::size_t tiles = (options.columns + side - 1) / side;
  for (std::size_t across = 0; across < tiles; ++across) {
    const std::size_t first = across * side;
    const std::size_t width = std::min<std::size_t>(side, options.columns - first);
    for (std::size_t row = 0; row < side; ++row) {
      const std::size_t from = std::min<std::size_t>(row, rows_there - 1);
      std::byte* const out = tile.data() + row * side * size;
      std::memcpy(out, band.data() + from * row_bytes + first * size, width * size);
      for (std::size_t i = width; i < side; ++i) {
        std::memcpy(out + i * size, out + (width - 1) * size, size);
      }
    }
    put_tile(static_cast<std::uint32_t>(across), down);
  }
}

GeoTiffWriter::GeoTiffWriter(const std::filesystem::path& path, const GeoTiffOptions& options) {
  assert(options.columns > 0 && options.rows > 0);
  assert(options.tile > 0 && options.tile % 16 == 0);
  impl_ = std::make_unique<Impl>(path, options);
  impl_->open();
  impl_->set_fields();
  impl_->set_georeference();
  impl_->tile.resize(std::size_t{options.tile} * options.tile * impl_->sample_bytes());
}

GeoTiffWriter::~GeoTiffWriter() = default;
GeoTiffWriter::GeoTiffWriter(GeoTiffWriter&&) noexcept = default;
GeoTiffWriter& GeoTiffWriter::operator=(GeoTiffWriter&&) noexcept = default;

void GeoTiffWriter::write_rows(std::span<const std::byte> samples) {
  Impl& impl = *impl_;
  const std::size_t row_bytes = impl.options.columns * impl.sample_bytes();
  assert(samples.size() % row_bytes == 0);
  assert(samples.size() / row_bytes <= impl.options.rows - impl.next_row);
  impl.by_rows = true;
  impl.band.resize(impl.options.tile * row_bytes);
  while (!samples.empty()) {
    const std::uint32_t at = impl.next_row % impl.options.tile;
    const std::size_t rows =
        std::min<std::size_t>(samples.size() / row_bytes, impl.options.tile - at);
    std::memcpy(impl.band.data() + at * row_bytes, samples.data(), rows * row_bytes);
    samples = samples.subspan(rows * row_bytes);
    impl.next_row += static_cast<std::uint32_t>(rows);
    const auto there = static_cast<std::uint32_t>(at + rows);
    if (there == impl.options.tile || impl.next_row == impl.options.rows) impl.flush_band(there);
  }
}

void GeoTiffWriter::write_tile(std::uint32_t across, std::uint32_t down,
                               std::span<const std::byte> samples) {
  assert(!impl_->by_rows);
  assert(samples.size() == impl_->tile.size());
  assert(std::uint64_t{across} * impl_->options.tile < impl_->options.columns);
  assert(std::uint64_t{down} * impl_->options.tile < impl_->options.rows);
  std::memcpy(impl_->tile.data(), samples.data(), samples.size());
  impl_->put_tile(across, down);
}

void GeoTiffWriter::commit() {
  Impl& impl = *impl_;
  assert(!impl.by_rows || impl.next_row == impl.options.rows);
  impl.complaint.clear();
  impl.check(TIFFWriteDirectory(impl.tiff), "the directory cannot be written");
  TIFFClose(std::exchange(impl.tiff, nullptr));
  if (impl.failure) impl.fail("cannot be written");
  impl.file.commit();
}

}  // namespace terrace::stream
