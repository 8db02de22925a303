// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "format/grid/header.hpp"
#include "format/grid/plain.hpp"
#include "format/grid/rasters.hpp"
#include "format/raster_points.hpp"
#include "format/registry.hpp"
#include "format/sidecars.hpp"
#include "io/line_reader.hpp"
#include "io/number.hpp"
#include "io/spool.hpp"
#include "io/text.hpp"
#include "raster/nodata.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

constexpr std::string_view kFormat = "ascii-grid";
constexpr std::array<std::string_view, 15> kKeys{
    "ncols",    "nrows",  "xllcorner", "xllcenter", "yllcorner", "yllcenter",
    "cellsize", "dx",     "dy",                                             // Esri
    "north:",   "south:", "east:",     "west:",     "rows:",     "cols:"};  // GRASS

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

/// Returns whether `word` is `key` in lower or upper case. `key` must be in lower case.
bool is_word(std::string_view word, std::string_view key) {
  return std::equal(word.begin(), word.end(), key.begin(), key.end(),
                    [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a + 32 : a) == b; });
}

bool is_key(std::string_view word) {
  return std::any_of(kKeys.begin(), kKeys.end(),
                     [&](std::string_view key) { return is_word(word, key); });
}

/// True for a word that marks a cell without data, as 12D, GRASS, R and others write it, and for
/// NaN and infinity as the C library of Windows writes them.
bool is_void_word(std::string_view word) {
  constexpr std::array<std::string_view, 6> kWords{"null", "*", "na", "n/a", "nodata", "no_data"};
  if (std::any_of(kWords.begin(), kWords.end(),
                  [&](std::string_view known) { return is_word(word, known); })) {
    return true;
  }
  if (word.find(".#") == std::string_view::npos) return false;
  const std::optional<double> value = NodataRule::parse(std::string(word), ScalarType::f64).value;
  return value && !std::isfinite(*value);
}

/// Splits text into words at white space, whatever the lengths of its lines.
class Words {
 public:
  explicit Words(Input& input) : input_(input) { refuse_utf16(input); }

  /// Returns the next word, valid until the next call; empty at the end. Throws: Error if it is
  /// longer than any number.
  std::string_view next() {
    for (;;) {
      while (at_ != end_ && is_white_space(*at_)) ++at_;
      const char* const begin = at_;
      while (at_ != end_ && !is_white_space(*at_)) ++at_;
      // A word at the end of the window may continue after it.
      if (at_ != end_ || ended_) return {begin, static_cast<std::size_t>(at_ - begin)};
      at_ = begin;
      more();
    }
  }

 private:
  static constexpr std::size_t kLongest = 1024;

  void more() {
    const auto pending = static_cast<std::size_t>(end_ - at_);
    if (pending > kLongest) {
      throw Error(input_.name(), "a word of more than 1,024 characters is not a number")
          .at_byte(input_.offset())
          .remedy("the file is damaged or not an ASCII grid: download it again");
    }
    input_.consume(static_cast<std::size_t>(at_ - begin_));
    const std::string_view window = input_.fill(pending + 1);
    ended_ = window.size() == pending;
    begin_ = at_ = window.data();
    end_ = at_ + window.size();
  }

  Input& input_;
  const char* begin_ = nullptr;  // of the window
  const char* at_ = nullptr;
  const char* end_ = nullptr;
  bool ended_ = false;
};

/// Parses a number with a decimal point or, as some countries write it, a comma.
const char* parse_sample(std::string_view word, double& value) {
  const char* const end = word.data() + word.size();
  const char* const rest = parse_real(word.data(), end, value);
  if (rest == end || word.size() > 64 || word.find(',') == std::string_view::npos) return rest;
  char copy[64];
  std::replace_copy(word.begin(), word.end(), copy, ',', '.');
  const char* const copied = parse_real(copy, copy + word.size(), value);
  return copied == nullptr ? nullptr : word.data() + (copied - copy);
}

/// Parses a coordinate in GRASS's header: a number, or degrees like 45:30:15.5N. nullopt if it is
/// neither.
std::optional<double> grass_coordinate(std::string_view text) {
  double value = 0;
  if (parse_real(text.data(), text.data() + text.size(), value) == text.data() + text.size()) {
    return std::isfinite(value) ? std::optional(value) : std::nullopt;
  }
  if (text.empty()) return std::nullopt;
  const char last = text.back();
  const bool negative = last == 'S' || last == 's' || last == 'W' || last == 'w';
  if (!negative && last != 'N' && last != 'n' && last != 'E' && last != 'e') return std::nullopt;
  text.remove_suffix(1);
  double sum = 0;
  for (double unit = 1; unit > 1e-4 && !text.empty(); unit /= 60) {
    const std::string_view part = text.substr(0, text.find(':'));
    if (part.empty() ||
        parse_real(part.data(), part.data() + part.size(), value) != part.data() + part.size()) {
      return std::nullopt;
    }
    sum += unit * value;
    text.remove_prefix(std::min(part.size() + 1, text.size()));
  }
  if (!text.empty() || !std::isfinite(sum)) return std::nullopt;
  return negative ? -sum : sum;
}

/// Reads an ASCII grid: its header when it is constructed, then its numbers.
class AsciiReader {
 public:
  /// nodata: see RasterOptions.
  AsciiReader(const std::string& file, const std::stop_token& stop,
              const std::optional<std::string>& nodata)
      : input_(file, stop),
        stop_(stop),
        words_(input_),
        header_(input_.name()),
        nodata_text_(nodata) {
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    word_ = words_.next();
    if (word_.starts_with(kByteOrderMark)) word_.remove_prefix(kByteOrderMark.size());
    for (std::string key; is_keyword(word_); word_ = words_.next()) {
      key = word_;
      header_.set(key, words_.next());
    }
    if (header_.has("rows:") || header_.has("cols:")) translate_grass_header();
    columns_ = header_.count("ncols");
    rows_ = header_.count("nrows");
    if (header_.has("byteorder")) {
      throw header_.fault("is the header of a binary grid")
          .remedy("name the .flt or .bil next to it");
    }
    if (!header_.has("cellsize") && !(header_.has("dx") && header_.has("dy"))) {
      throw header_.fault("is missing").at("cellsize");
    }
    static_cast<void>(grid(ScalarType::f64));  // checks columns and rows
    // Each number has a digit and something between it and the next.
    if (input_.size() && columns_ * rows_ > *input_.size() / 2 + 1) {
      throw header_
          .fault(fmt::format("promises {} x {} numbers, more than fit into {}", columns_, rows_,
                             counted(*input_.size(), "byte")))
          .remedy("the file is truncated: download it again");
    }
  }

  /// Describes the grid, with samples of `type`.
  [[nodiscard]] PlainGrid grid(ScalarType type) const {
    PlainGrid grid = plain_grid(std::string(kFormat), input_.name(), columns_, rows_, type);
    grid.info.nodata = nodata().value;
    grid.info.world = header_.world(rows_, grid.info.comments);
    grid.info.sample.scale = scale_;
    return grid;
  }
  [[nodiscard]] NodataRule nodata() const {
    NodataRule rule =
        NodataRule::parse(nodata_text_.value_or(header_.text("nodata_value")), ScalarType::f64);
    // Programs that compute with floats often use the lowest float as nodata value, which may have
    // another number of digits in the header than in the cells.
    constexpr double kNoHeight = 1e38;
    if (rule.value && *rule.value < -kNoHeight) rule.high = -kNoHeight;
    if (rule.value && *rule.value > kNoHeight) rule.low = kNoHeight;
    return rule;
  }
  [[nodiscard]] const std::string& name() const { return input_.name(); }

  /// Passes each number to take(double) until that returns false.
  template <class Take>
  void read(Take&& take) {
    const std::uint64_t cells = columns_ * rows_;
    for (std::uint64_t cell = 0; cell < cells; ++cell, word_ = words_.next()) {
      if (cell % kCheckEvery == 0 && stop_.stop_requested()) throw Stopped();
      double value = 0;
      if (word_.empty()) {
        throw header_
            .fault(fmt::format("holds {} where {} x {} are expected", counted(cell, "number"),
                               columns_, rows_))
            .remedy("the file is truncated: download it again");
      }
      if (parse_sample(word_, value) != word_.data() + word_.size()) {
        if (is_void(word_)) {
          value = std::numeric_limits<double>::quiet_NaN();
        } else {
          throw header_.fault(in_quotes(word_) + " is not a number")
              .at(fmt::format("row {}, column {}", cell / columns_, cell % columns_))
              .remedy("correct it, or make it the NODATA_value if it means no data");
        }
      }
      if (!take(value)) return;
    }
    if (!word_.empty()) {
      throw header_
          .fault(fmt::format("holds more numbers than the {} x {} that its header promises",
                             columns_, rows_))
          .remedy("correct the header");
    }
  }

 private:
  [[nodiscard]] bool is_void(std::string_view word) const {
    return is_void_word(word) || (!word.empty() && (word == header_.text("nodata_value") ||
                                                    word == header_.text("null:")));
  }
  [[nodiscard]] bool is_keyword(std::string_view word) const {
    double number = 0;  // "nan" and "inf" are numbers
    return !word.empty() && is_letter(word.front()) &&
           parse_sample(word, number) != word.data() + word.size() && !is_void(word);
  }
  /// Sets Esri's keys from GRASS's (r.out.ascii), which give the borders of the grid instead of the
  /// size of its cells.
  void translate_grass_header() {
    const auto coordinate = [&](const char* key) {
      if (!header_.has(key)) throw header_.fault("is missing").at(key);
      const std::optional<double> value = grass_coordinate(header_.text(key));
      if (!value)
        throw header_.fault("is " + in_quotes(header_.text(key)) + ", not a coordinate").at(key);
      return *value;
    };
    const auto set = [&](const char* key, double value) {
      std::string text;
      append_number(text, value);
      header_.set(key, text);
    };
    const double north = coordinate("north:"), south = coordinate("south:"),
                 east = coordinate("east:"), west = coordinate("west:");
    const std::uint64_t columns = header_.count("cols:"), rows = header_.count("rows:");
    if (columns == 0 || rows == 0) throw header_.fault("the grid has no cells").at("rows:");
    const double width = (east - west) / static_cast<double>(columns);
    const double height = (north - south) / static_cast<double>(rows);
    if (!(width > 0 && height > 0)) throw header_.fault("the borders enclose no area").at("north:");
    header_.set("ncols", header_.text("cols:"));
    header_.set("nrows", header_.text("rows:"));
    set("dx", width);
    set("dy", height);
    set("ulxmap", west + width / 2);
    set("ulymap", north - height / 2);
    header_.set("nodata_value", header_.has("null:") ? header_.text("null:") : "*");
    scale_ = header_.number("multiplier:").value_or(1);
    if (scale_ == 0) throw header_.fault("is zero").at("multiplier:");
  }

  static constexpr std::uint64_t kCheckEvery = 1u << 16;

  Input input_;
  std::stop_token stop_;
  Words words_;
  GridHeader header_;
  std::optional<std::string> nodata_text_;
  double scale_ = 1;
  std::string_view word_;
  std::uint64_t columns_ = 0, rows_ = 0;
};

bool cell_has_data(double value, const NodataRule& nodata) {
  return std::isfinite(value) && (value < nodata.low || value > nodata.high);
}

bool is_exact_float(double value) {
  return std::abs(value) <= std::numeric_limits<float>::max() &&
         static_cast<double>(static_cast<float>(value)) == value;
}

/// Collects samples in a temporary file, as floats as long as these are exact; NaN is nodata.
class SampleSpool {
 public:
  SampleSpool(const std::string& name, ScalarType type)
      : spool_(std::make_unique<Spool>(name)), type_(type) {}

  void add_void() {
    type_ == ScalarType::f32 ? put(std::numeric_limits<float>::quiet_NaN())
                             : put(std::numeric_limits<double>::quiet_NaN());
  }
  void add(double value) {
    if (type_ == ScalarType::f32 && !is_exact_float(value)) widen();
    type_ == ScalarType::f32 ? put(static_cast<float>(value)) : put(value);
  }
  [[nodiscard]] ScalarType type() const { return type_; }
  std::unique_ptr<ByteSource> take() {
    flush();
    return std::move(spool_);
  }

 private:
  static constexpr std::size_t kPieceBytes = 64u << 10;

  template <class T>
  void put(T value) {
    std::memcpy(piece_.data() + filled_, &value, sizeof value);
    filled_ += sizeof value;
    if (filled_ == piece_.size()) flush();
  }
  void flush() {
    spool_->append({piece_.data(), filled_});
    filled_ = 0;
  }
  void widen() {
    flush();
    const std::unique_ptr<Spool> floats =
        std::exchange(spool_, std::make_unique<Spool>(spool_->name()));
    type_ = ScalarType::f64;
    std::vector<float> piece(kPieceBytes / sizeof(float));
    for (std::uint64_t at = 0; at < floats->size();) {
      const auto bytes =
          static_cast<std::size_t>(std::min<std::uint64_t>(kPieceBytes, floats->size() - at));
      floats->read(at, std::as_writable_bytes(std::span(piece)).first(bytes));
      for (std::size_t i = 0; i < bytes / sizeof(float); ++i) put(static_cast<double>(piece[i]));
      at += bytes;
    }
  }

  std::unique_ptr<Spool> spool_;
  ScalarType type_;
  std::vector<std::byte> piece_ = std::vector<std::byte>(kPieceBytes);
  std::size_t filled_ = 0;
};

/// Reads all samples; returns them and the type that they turned out to need.
std::pair<std::unique_ptr<ByteSource>, ScalarType> spooled_samples(AsciiReader& reader,
                                                                   ScalarType type) {
  SampleSpool samples(reader.name(), type);
  const NodataRule nodata = reader.nodata();
  reader.read([&](double value) {
    cell_has_data(value, nodata) ? samples.add(value) : samples.add_void();
    return true;
  });
  std::unique_ptr<ByteSource> bytes = samples.take();
  return {std::move(bytes), samples.type()};
}

bool recognise_ascii_grid(std::span<const std::byte> head) {
  std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  while (!text.empty() && is_white_space(text.front())) text.remove_prefix(1);
  return is_key(text.substr(
      0, static_cast<std::size_t>(std::find_if(text.begin(), text.end(), is_white_space) -
                                  text.begin())));
}

std::unique_ptr<PointSource> open_ascii_points(std::span<const std::string> files,
                                               const SourceOptions& options) {
  // The rasters of a mosaic have one type.
  std::optional<ScalarType> type;
  if (files.size() > 1) {
    const bool wide = std::any_of(files.begin(), files.end(), [&](const std::string& file) {
      return type_of_ascii_grid(file, options.stop) == ScalarType::f64;
    });
    type = wide ? ScalarType::f64 : ScalarType::f32;
  }
  return open_raster_points(
      files, options,
      [stop = options.stop, type](const std::string& file, const RasterOptions& raster) {
        check_band(file, raster.band, 1);
        return open_ascii_grid(file, stop, type);
      });
}

}  // namespace

std::unique_ptr<Raster> open_ascii_grid(const std::string& file, const std::stop_token& stop,
                                        std::optional<ScalarType> known,
                                        const std::optional<std::string>& nodata) {
  AsciiReader reader(file, stop, nodata);
  if (known) {
    PlainGrid grid = reader.grid(*known);
    grid.info.files = {file};
    place_by_world_file(file, grid.info);
    return open_packed_grid(std::move(grid), [file, stop, type = *known, nodata] {
      AsciiReader second_reader(file, stop, nodata);
      return spooled_samples(second_reader, type).first;
    });
  }
  auto [bytes, type] = spooled_samples(reader, ScalarType::f32);
  PlainGrid grid = reader.grid(type);
  grid.info.files = {file};
  place_by_world_file(file, grid.info);
  return open_plain_grid(std::move(grid), std::move(bytes));
}

ScalarType type_of_ascii_grid(const std::string& file, const std::stop_token& stop) {
  AsciiReader reader(file, stop, {});
  const NodataRule nodata = reader.nodata();
  ScalarType type = ScalarType::f32;
  reader.read([&](double value) {
    if (cell_has_data(value, nodata) && !is_exact_float(value)) type = ScalarType::f64;
    return type == ScalarType::f32;
  });
  return type;
}

const Format& ascii_grid_format() {
  static const Format format{.name = std::string(kFormat),
                             .endings = {".asc", ".agr"},
                             .streams = true,
                             .recognise = &recognise_ascii_grid,
                             .open = &open_ascii_points,
                             .raster = true};
  return format;
}

}  // namespace terrace::stream
