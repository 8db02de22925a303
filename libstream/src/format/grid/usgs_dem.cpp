// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "format/grid/plain.hpp"
#include "format/grid/rasters.hpp"
#include "format/raster_points.hpp"
#include "format/registry.hpp"
#include "io/number.hpp"
#include "io/spool.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

// Record A: the offsets of its fields.
constexpr std::size_t kLevel = 144, kPattern = 150, kSystem = 156, kZone = 162, kGroundUnit = 528,
                      kHeightUnit = 534, kSides = 540, kCorners = 546, kResolution = 816,
                      kProfiles = 858, kOldEnd = 864, kVerticalDatum = 888, kHorizontalDatum = 890;
constexpr std::size_t kInteger = 6, kReal = 24, kShortReal = 12, kRecord = 1024;
constexpr int kNone = -32767;
/// The number of samples in a profile has at most six digits.
constexpr double kMaxRows = 999'999;

std::optional<std::int32_t> integer_in(std::string_view field) {
  field = trim(field);
  std::int32_t value = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc{} || end != field.data() + field.size()) return std::nullopt;
  return value;
}

/// Parses a number as Fortran writes it: the exponent may begin with D.
std::optional<double> real_in(std::string_view field) {
  field = trim(field);
  if (field.empty() || field.size() > kReal) return std::nullopt;
  std::array<char, kReal> digits{};
  std::replace_copy_if(
      field.begin(), field.end(), digits.begin(), [](char c) { return c == 'D' || c == 'd'; }, 'E');
  const char* const end = digits.data() + field.size();
  double value = 0;
  if (parse_real(digits.data(), end, value) != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// The fields of record A.
struct Head {
  enum class Ground { utm, seconds, other };

  Ground ground = Ground::other;
  int zone = 0;
  int ground_unit = 0;                    ///< 1 feet, 2 metres, 3 arc seconds
  bool feet = false;                      ///< heights
  double west = 0, south = 0, north = 0;  ///< of the outermost samples, in ground units
  double width = 0, height = 0;           ///< of a cell
  double step = 1;                        ///< of heights
  std::uint64_t columns = 0, rows = 0;
  std::optional<int> vertical_datum, horizontal_datum;  ///< missing in the old form
};

Head head_of(std::string_view record, const std::string& file) {
  const auto not_a_number = [&](std::size_t at, const char* what) {
    throw grid_fault(file, fmt::format("{} is not a number", what)).at_byte(at);
  };
  const auto integer = [&](std::size_t at, const char* what) {
    const auto value = integer_in(record.substr(at, kInteger));
    if (!value) not_a_number(at, what);
    return *value;
  };
  const auto real = [&](std::size_t at, std::size_t length, const char* what) {
    const auto value = real_in(record.substr(at, length));
    if (!value) not_a_number(at, what);
    return *value;
  };
  Head head;
  const int system = integer(kSystem, "the code of the ground's reference system");
  head.zone = integer_in(record.substr(kZone, kInteger)).value_or(0);
  head.ground_unit = integer(kGroundUnit, "the unit of the ground");
  head.feet = integer(kHeightUnit, "the unit of heights") == 1;
  if (integer(kPattern, "the pattern") != 1 || integer(kSides, "the number of sides") != 4) {
    throw grid_fault(file, "is not a regular grid with four sides")
        .remedy("convert it: gdal_translate FILE out.tif");
  }
  head.ground = system == 0 || head.ground_unit == 3 ? Head::Ground::seconds
                : system == 1                        ? Head::Ground::utm
                                                     : Head::Ground::other;
  std::array<double, 8> corners{};  // x, y of south-west, north-west, north-east, south-east
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners[i] = real(kCorners + i * kReal, kReal, "a corner");
  }
  head.width = real(kResolution, kShortReal, "the resolution in x");
  head.height = real(kResolution + kShortReal, kShortReal, "the resolution in y");
  head.step = real(kResolution + 2 * kShortReal, kShortReal, "the resolution of heights");
  if (!(head.width > 0 && head.height > 0 && head.step > 0)) {
    throw grid_fault(file, "a resolution is not positive").at_byte(kResolution);
  }
  head.west = std::min(corners[0], corners[2]);
  head.south = std::min(corners[1], corners[7]);
  head.north = std::max(corners[3], corners[5]);
  if (head.ground != Head::Ground::seconds) {
    // The corners are those of a quadrangle of the globe; samples are at multiples of their
    // spacing.
    head.south = std::floor(head.south / head.height) * head.height;
    head.north = std::ceil(head.north / head.height) * head.height;
  }
  const double rows = std::floor((head.north - head.south) / head.height + 1.5);
  if (!(rows >= 1 && rows <= kMaxRows)) {
    throw grid_fault(file, "the number of rows between its corners is not from 1 to 999,999");
  }
  head.rows = static_cast<std::uint64_t>(rows);
  head.south = head.north - (rows - 1) * head.height;
  const int profiles = integer(kProfiles, "the number of profiles");
  head.columns = static_cast<std::uint64_t>(std::max(profiles, 0));
  if (record.size() >= kRecord) {
    head.vertical_datum = integer_in(record.substr(kVerticalDatum, 2));
    head.horizontal_datum = integer_in(record.substr(kHorizontalDatum, 2));
  }
  return head;
}

Crs usgs_crs(const Head& head, std::vector<std::string>& comments) {
  Crs crs;
  crs.geographic = head.ground == Head::Ground::seconds;
  crs.horizontal_unit = crs.geographic ? "degree" : head.ground_unit == 1 ? "foot" : "metre";
  crs.vertical_unit = head.feet ? "foot" : "metre";
  // NAD 27, WGS 72, WGS 84, NAD 83: the EPSG code for longitude and latitude, the number to which
  // the UTM zone is added, and the number of zones that have a code.
  constexpr std::array<std::array<int, 3>, 4> kDatums{
      {{4267, 26700, 22}, {4322, 32200, 60}, {4326, 32600, 60}, {4269, 26900, 23}}};
  const int datum = head.horizontal_datum.value_or(1);
  if (!head.horizontal_datum) {
    comments.emplace_back("its header names no datum, so it is NAD 27, as in all early files");
  }
  if (datum >= 1 && datum <= 4) {
    const auto [degrees, utm, zones] = kDatums[static_cast<std::size_t>(datum - 1)];
    const bool zone = head.zone >= 1 && head.zone <= zones;
    if (head.ground == Head::Ground::seconds) crs.epsg = degrees;
    if (head.ground == Head::Ground::utm && zone) crs.epsg = utm + head.zone;
  }
  if (crs.epsg == 0) comments.emplace_back("its header names no CRS with an EPSG code");
  if (!head.feet && head.vertical_datum == 2) crs.vertical_epsg = 7968;  // NGVD 29
  if (!head.feet && head.vertical_datum == 3) crs.vertical_epsg = 5703;  // NAVD 88
  return crs;
}

/// Reads the fields of profiles: numbers with a limited number of characters, after any white
/// space. Records are padded, and some files have line breaks.
class Fields {
 public:
  Fields(Input& input, const std::string& file) : input_(input), file_(file) {}

  std::int32_t integer(const char* what) {
    const std::string_view field = next(kInteger);
    const auto value = integer_in(field);
    if (!value) throw unreadable(field, what);
    return *value;
  }
  double real(const char* what) {
    const std::string_view field = next(kReal);
    const auto value = real_in(field);
    if (!value) throw unreadable(field, what);
    return *value;
  }

 private:
  std::string_view next(std::size_t max_characters) {
    input_.consume(last_);
    last_ = 0;
    std::string_view window = input_.window();
    for (;;) {
      const auto* const word = std::find_if_not(window.begin(), window.end(), is_white_space);
      input_.consume(static_cast<std::size_t>(word - window.begin()));
      window = input_.window();
      if (window.size() > max_characters) break;
      const std::size_t before = window.size();
      window = input_.fill(max_characters + 1);
      if (window.size() == before) break;
    }
    const auto* const begin = window.begin();
    const auto* end = begin;
    while (end != window.end() && static_cast<std::size_t>(end - begin) < max_characters &&
           !is_white_space(*end) &&
           (end == begin || *end != '-' || end[-1] == 'D' || end[-1] == 'd' || end[-1] == 'E' ||
            end[-1] == 'e')) {
      ++end;
    }
    last_ = static_cast<std::size_t>(end - begin);
    return window.substr(0, last_);
  }
  [[nodiscard]] Error unreadable(std::string_view field, const char* what) const {
    return grid_fault(file_, field.empty() ? std::string("the file ends before a ") + what
                                           : in_quotes(field) + " is not a " + what)
        .at_byte(input_.offset());
  }

  Input& input_;
  const std::string& file_;
  std::size_t last_ = 0;  ///< characters of the field last returned
};

/// Writes columns of samples to a file of rows, some columns at a time.
class ColumnSpool {
 public:
  ColumnSpool(const std::string& name, std::uint64_t columns, std::uint64_t rows)
      : spool_(std::make_unique<Spool>(name)),
        columns_(columns),
        rows_(rows),
        at_once_(std::clamp<std::uint64_t>(kBytes / (rows * sizeof(std::int32_t)), 1, columns)) {
    band_.assign(at_once_ * rows_, kNone);
  }

  /// Sets a sample. Rows count from the north; columns must not decrease.
  void put(std::uint64_t column, std::uint64_t row, std::int32_t value) {
    band_[row * at_once_ + column % at_once_] = value;
  }
  /// Announces that no more samples of earlier columns follow.
  void begin(std::uint64_t column) {
    for (; first_ + at_once_ <= column; first_ += at_once_) flush();
  }
  std::unique_ptr<ByteSource> take() {
    for (; first_ < columns_; first_ += at_once_) flush();
    return std::move(spool_);
  }

 private:
  static constexpr std::uint64_t kBytes = 4u << 20;

  void flush() {
    const std::uint64_t count = std::min(at_once_, columns_ - first_);
    for (std::uint64_t row = 0; row < rows_; ++row) {
      spool_->write((row * columns_ + first_) * sizeof(std::int32_t),
                    std::as_bytes(std::span(band_).subspan(row * at_once_, count)));
    }
    std::fill(band_.begin(), band_.end(), kNone);
  }

  std::unique_ptr<Spool> spool_;
  std::uint64_t columns_, rows_, at_once_;
  std::uint64_t first_ = 0;  ///< column of the band
  std::vector<std::int32_t> band_;
};

/// Reads all records B. west: set to x of the first one.
std::unique_ptr<ByteSource> read_profiles(Input& input, const Head& head, const std::string& file,
                                          const std::stop_token& stop, double& west) {
  Fields fields(input, file);
  ColumnSpool spool(file, head.columns, head.rows);
  for (std::uint64_t column = 0; column < head.columns; ++column) {
    if (stop.stop_requested()) throw Stopped();
    const std::string where = fmt::format("profile {}", column + 1);
    // A quadrangle fills most of its grid, so a nearly empty grid is a forgery.
    constexpr std::uint64_t kMaxRowsPerByte = 1;
    if (column * head.rows > kMaxRowsPerByte * input.offset()) {
      throw grid_fault(file, "its profiles have less than a byte for each row of the grid")
          .at(where);
    }
    fields.integer("number of a row");
    fields.integer("number of a profile");
    const std::int32_t samples = fields.integer("number of samples");
    if (fields.integer("number of columns") != 1 || samples < 0) {
      throw grid_fault(file, "is not one column of samples").at(where);
    }
    const double x = fields.real("coordinate"), y = fields.real("coordinate");
    const double datum = fields.real("local datum");
    fields.real("least height");
    fields.real("greatest height");
    if (column == 0) west = x;
    if (!(std::abs(x - west - static_cast<double>(column) * head.width) < head.width)) {
      throw grid_fault(file, "is not adjacent to the previous one").at(where);
    }
    const double offset = datum / head.step;
    if (std::abs(offset) > 1e9 || std::abs(offset - std::round(offset)) > 1e-6) {
      throw grid_fault(file, "its local datum is not a multiple of the resolution of heights")
          .at(where)
          .remedy("convert it: gdal_translate FILE out.tif");
    }
    const double up = std::floor((y - head.south) / head.height + 0.5);
    if (!(std::abs(up) < 0x1p31)) throw grid_fault(file, "is outside the grid").at(where);
    spool.begin(column);
    for (std::int32_t i = 0; i < samples; ++i) {
      const std::int32_t raw = fields.integer("height");
      const std::int64_t row =
          static_cast<std::int64_t>(head.rows) - 1 - static_cast<std::int64_t>(up) - i;
      // Samples outside belong to parts of the quadrangle beyond the corners.
      if (raw == kNone || row < 0 || row >= static_cast<std::int64_t>(head.rows)) continue;
      spool.put(column, static_cast<std::uint64_t>(row),
                raw + static_cast<std::int32_t>(std::lround(offset)));
    }
  }
  return spool.take();
}

bool recognise_usgs(std::span<const std::byte> head) {
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  if (text.size() < kOldEnd) return false;
  const auto integer = [&](std::size_t at, int low, int high) {
    const auto value = integer_in(text.substr(at, kInteger));
    return value && *value >= low && *value <= high;
  };
  return integer(kLevel, 1, 4) && integer(kPattern, 1, 2) && integer(kSystem, 0, 20) &&
         integer(kGroundUnit, 0, 3) && integer(kHeightUnit, 1, 2) && integer(kSides, 4, 4);
}

std::unique_ptr<PointSource> open_usgs_points(std::span<const std::string> files,
                                              const SourceOptions& options) {
  return open_raster_points(
      files, options, [stop = options.stop](const std::string& file, const RasterOptions& raster) {
        check_band(file, raster.band, 1);
        return open_usgs_dem(file, stop);
      });
}

}  // namespace

std::unique_ptr<Raster> open_usgs_dem(const std::string& file, const std::stop_token& stop) {
  Input input(file, stop);
  const std::string_view record = input.fill(kRecord);
  if (record.size() < kOldEnd) {
    throw grid_fault(input.name(), "is shorter than the header of a USGS DEM");
  }
  // In the old form, record B follows immediately if there is no padding.
  const std::string_view rest =
      trim_left(record.substr(kOldEnd, std::min(record.size(), kRecord) - kOldEnd));
  const bool cut =
      integer_in(record.substr(kOldEnd, kInteger)) == 1 &&
      integer_in(record.substr(std::min(record.size(), kOldEnd + kInteger), kInteger)) == 1;
  const bool old = cut || rest.empty();
  const std::size_t bytes = cut ? kOldEnd : std::min(record.size(), kRecord);
  const Head head = head_of(record.substr(0, old ? kOldEnd : bytes), input.name());
  PlainGrid grid = plain_grid("usgs-dem", input.name(), head.columns, head.rows, ScalarType::i32,
                              fmt::format("{}", kNone));
  grid.info.files = {file};
  input.consume(bytes);
  double west = head.west;
  std::unique_ptr<ByteSource> samples = read_profiles(input, head, input.name(), stop, west);
  // Take longitudes from the header, which has them with more digits.
  if (head.ground == Head::Ground::seconds) west = head.west;
  const double unit = head.ground == Head::Ground::seconds ? 3600.0 : 1.0;
  grid.info.world.xy = {head.width / unit, 0, west / unit, 0, -head.height / unit,
                        head.north / unit};
  grid.info.crs = usgs_crs(head, grid.info.comments);
  grid.info.sample.scale = head.step;
  grid.info.sample.unit = grid.info.crs.vertical_unit;
  return open_plain_grid(std::move(grid), std::move(samples));
}

const Format& usgs_dem_format() {
  static const Format format{.name = "usgs-dem",
                             .endings = {".dem"},
                             .streams = true,
                             .recognise = &recognise_usgs,
                             .open = &open_usgs_points,
                             .raster = true};
  return format;
}

}  // namespace terrace::stream
