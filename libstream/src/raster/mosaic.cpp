// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <list>
#include <optional>
#include <sstream>
#include <utility>

#include <fmt/core.h>

#include "crs_agreement.hpp"
#include "io/peek.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/raster.hpp"

namespace terrace::stream {
namespace {

constexpr std::uint64_t kMaxMosaicCells = 1u << 30;
constexpr std::size_t kMaxWkt = std::size_t{64} << 10;

std::string short_text(double value) {
  std::ostringstream out;
  out.precision(3);
  out << value;
  return out.str();
}

std::string exact_text(double value) {
  std::ostringstream out;
  out.precision(17);
  out << value;
  return out.str();
}

Error mismatch_error(const std::string& first, const std::string& other, const std::string& what) {
  return {other, fmt::format("does not match {}: {}", first, what)};
}

/// Returns the column and row of `frame` at x, y.
std::array<double, 2> cell_of(const WorldTransform& frame, double x, double y) {
  const auto& m = frame.xy;
  const double determinant = m[0] * m[4] - m[1] * m[3];
  const double dx = x - m[2], dy = y - m[5];
  return {(m[4] * dx - m[1] * dy) / determinant, (m[0] * dy - m[3] * dx) / determinant};
}

/// A raster of the mosaic and its place in the cells of the mosaic.
struct Member {
  std::string file;
  std::int64_t column = 0, row = 0;  // of its first cell; until unite(), from the first file's
  std::uint64_t columns = 0, rows = 0;
  std::uint64_t held_bytes = 0;
};

/// Places a raster in the cells of the first one. All four corners must be on cells, to
/// kNearestCell, so that cell sizes and rotation agree too. max_offset: raised to the largest
/// distance of a corner from its cell, in cells.
Member place_member(const RasterInfo& first, const RasterInfo& other, double& max_offset) {
  const std::string &a = first.files.front(), &b = other.files.front();
  const auto& m = other.world.xy;
  const auto corner = [&](double c, double r) {
    return cell_of(first.world, m[0] * c + m[1] * r + m[2], m[3] * c + m[4] * r + m[5]);
  };
  const std::string align = "align them first: gdalwarp -tap -tr, or gdalbuildvrt -resolution";
  const std::array<double, 2> origin = corner(0, 0);
  const double column = std::round(origin[0]), row = std::round(origin[1]);
  const auto width = static_cast<double>(other.columns), height = static_cast<double>(other.rows);
  for (const auto& [c, r] :
       {std::pair(width, 0.0), std::pair(0.0, height), std::pair(width, height)}) {
    const auto at = corner(c, r);
    const double stretch =
        std::max(std::abs(at[0] - origin[0] - c), std::abs(at[1] - origin[1] - r));
    max_offset = std::max({max_offset, std::abs(at[0] - column - c), std::abs(at[1] - row - r)});
    if (!(stretch <= kNearestCell)) {
      throw mismatch_error(
          a, b,
          fmt::format("its cells are {} x {}, not {} x {}", exact_text(m[0]), exact_text(m[4]),
                      exact_text(first.world.xy[0]), exact_text(first.world.xy[4])))
          .remedy(align);
    }
  }
  const double shift = std::max(std::abs(origin[0] - column), std::abs(origin[1] - row));
  max_offset = std::max(max_offset, shift);
  if (!(shift <= kNearestCell)) {
    throw mismatch_error(a, b,
                         fmt::format("its cells are shifted by {}, {} of a cell",
                                     short_text(origin[0] - column), short_text(origin[1] - row)))
        .remedy(align);
  }
  if (std::abs(column) >= 0x1p31 || std::abs(row) >= 0x1p31) {
    throw mismatch_error(a, b, "it is 2^31 or more cells away").remedy("read them separately");
  }
  return {.file = b,
          .column = static_cast<std::int64_t>(column),
          .row = static_cast<std::int64_t>(row),
          .columns = other.columns,
          .rows = other.rows,
          .held_bytes = other.held_bytes};
}

std::string unit_name(const std::string& unit) {
  return unit.empty() ? "an unknown unit" : '"' + unit + '"';
}

void check_samples(const RasterInfo& first, const RasterInfo& other) {
  const std::string &a = first.files.front(), &b = other.files.front();
  if (first.sample.type != other.sample.type) {
    throw mismatch_error(a, b,
                         fmt::format("its samples are {}, not {}", name_of(other.sample.type),
                                     name_of(first.sample.type)))
        .remedy("convert one: gdal_translate -ot");
  }
  if (first.sample.scale != other.sample.scale || first.sample.offset != other.sample.offset) {
    throw mismatch_error(
        a, b,
        fmt::format("its scale and offset are {}, {}, not {}, {}", exact_text(other.sample.scale),
                    exact_text(other.sample.offset), exact_text(first.sample.scale),
                    exact_text(first.sample.offset)))
        .remedy("make them agree: gdal_translate -unscale");
  }
  if (first.sample.unit != other.sample.unit) {
    throw mismatch_error(a, b,
                         fmt::format("its heights are in {}, not {}", unit_name(other.sample.unit),
                                     unit_name(first.sample.unit)))
        .remedy("give both the same unit (gdal_edit.py -units), or convert one (gdal_calc.py)");
  }
}

void check_crs(const RasterInfo& first, const RasterInfo& other) {
  const auto described = [](const Crs& crs) {
    std::ostringstream text;
    if (crs.epsg != 0) {
      text << "EPSG:" << crs.epsg;
    } else {
      // The first quoted text of WKT is the name.
      const std::size_t quote = crs.name.empty() ? crs.wkt.find('"') : crs.wkt.npos;
      const std::string name =
          quote == crs.wkt.npos
              ? crs.name
              : crs.wkt.substr(quote + 1, crs.wkt.find('"', quote + 1) - quote - 1);
      text << (name.empty() ? "unknown" : '"' + name + '"');
    }
    if (crs.vertical_epsg != 0) text << '+' << crs.vertical_epsg;
    return text.str();
  };
  const Crs &a = first.crs, &b = other.crs;
  const bool same_name = a.epsg != 0 || (a.name == b.name && a.wkt == b.wkt);
  if (a.epsg == b.epsg && same_name && a.vertical_epsg == b.vertical_epsg &&
      a.geographic == b.geographic && a.horizontal_unit == b.horizontal_unit &&
      (a.epsg != 0 || a.geo_keys == b.geo_keys)) {
    return;
  }
  throw mismatch_error(first.files.front(), other.files.front(),
                       fmt::format("its CRS is {}, not {}", described(b), described(a)))
      .remedy("reproject one (gdalwarp -t_srs), or give the CRS of all");
}

/// Returns the number of columns around the Earth; 0 if it is not an integer or is unknown.
std::int64_t columns_around(const WorldTransform& world, const Crs& crs) {
  const auto& m = world.xy;
  const bool degrees = crs.horizontal_unit.empty() || crs.horizontal_unit == "degree";
  // WKT is only interpreted later, but the size of a degree in radians shows that the unit is
  // degrees.
  const bool geographic =
      crs.geographic || (crs.wkt.starts_with("GEOG") && crs.wkt.find("0.01745329") != crs.wkt.npos);
  if (!geographic || !degrees || m[1] != 0 || m[3] != 0 || !(m[0] > 0)) return 0;
  const double columns = 360 / m[0];
  const bool is_integer = columns < 0x1p31 && std::abs(columns - std::round(columns)) <= kSameCell;
  return is_integer ? static_cast<std::int64_t>(std::round(columns)) : 0;
}

std::int64_t modulo(std::int64_t value, std::int64_t turn) { return (value % turn + turn) % turn; }

/// Joins members across the antimeridian, where files in longitudes of -180 to 180 are cut. If the
/// members together are wider than half a turn, but would be at most half a turn wide after moving
/// some by complete turns, moves these. Returns whether it did.
bool join_around(std::vector<Member>& members, const WorldTransform& world, std::int64_t turn) {
  const auto end_of = [](std::int64_t column, const Member& member) {
    return column + static_cast<std::int64_t>(member.columns);
  };
  std::int64_t left = INT64_MAX, right = INT64_MIN;
  std::vector<std::array<std::int64_t, 2>> spans;  // columns, each beginning in the first turn
  for (const Member& member : members) {
    left = std::min(left, member.column);
    right = std::max(right, end_of(member.column, member));
    const std::int64_t column = modulo(member.column, turn);
    spans.push_back({column, end_of(column, member)});
  }
  if (2 * (right - left) <= turn) return false;
  std::sort(spans.begin(), spans.end());
  // A range that begins at one span and goes around ends where the spans before that end one turn
  // later.
  std::vector<std::int64_t> ends(spans.size());  // the maximum end of this span and those after it
  for (std::size_t i = spans.size(); i-- > 0;) {
    ends[i] = i + 1 < spans.size() ? std::max(spans[i][1], ends[i + 1]) : spans[i][1];
  }
  std::int64_t first = 0, width = INT64_MAX, before = INT64_MIN;
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const std::int64_t end = i == 0 ? ends[0] : std::max(ends[i], before + turn);
    if (end - spans[i][0] < width) {
      width = end - spans[i][0];
      first = spans[i][0];
    }
    before = std::max(before, spans[i][1]);
  }
  if (2 * width > turn) return false;
  const double west = world.xy[0] * static_cast<double>(first) + world.xy[2];
  first -= turn * static_cast<std::int64_t>(std::floor((west + 180) / 360 + 1e-9));
  for (Member& member : members) member.column = first + modulo(member.column - first, turn);
  return true;
}

/// Implements open_mosaic(). Keeps the most recently used members open.
class Mosaic final : public Raster {
 public:
  Mosaic(const std::vector<std::string>& files, RasterOpener opener, const std::optional<Crs>& crs,
         std::size_t open_at_once, std::uint64_t open_bytes, const SameCrs& same_crs)
      : opener_(std::move(opener)), open_at_once_(open_at_once), open_bytes_(open_bytes) {
    assert(!files.empty());
    std::optional<RasterInfo> first;
    double farthest = 0;
    std::string farthest_file;
    std::optional<CrsAgreement> agreement;
    for (const std::string& file : files) {
      const std::unique_ptr<Raster> raster = opener_(file);
      // A member may be only a part of a file.
      RasterInfo info = raster->info();
      for (std::string& name : info.files) {
        if (files_.empty() || files_.back() != name) files_.push_back(std::move(name));
      }
      info.files = {file};
      if (!first) {
        first = info;
        agreement.emplace(first->crs, same_crs);
      } else {
        check_samples(*first, info);
        if (!crs && !agreement->agrees(info.crs)) check_crs(*first, info);
      }
      double max_offset = 0;
      members_.push_back(place_member(*first, info, max_offset));
      if (max_offset > farthest) {
        farthest = max_offset;
        farthest_file = file;
      }
      for (const std::string& line : info.notes) {
        if (notes_.size() < kMaxComments) notes_.push_back(line);
      }
      for (const std::string& comment : info.comments) {
        std::string line = file;
        note(line.append(": ").append(comment));
      }
    }
    if (farthest > kSameCell) {
      notes_.push_back(
          fmt::format("the cells of {} are up to {} of a cell off those of {}, and are placed on "
                      "the nearest cells",
                      farthest_file, short_text(farthest), files.front()));
    }
    unite(*first, crs.value_or(first->crs));
    info_.notes = std::move(notes_);
  }

  [[nodiscard]] const RasterInfo& info() const override { return info_; }

  void set_open_bytes(std::uint64_t bytes) override { open_bytes_ = bytes; }

  bool read_over(const CellWindow& window, const CellBuffer& out) override {
    bool any = false;
    const auto left = static_cast<std::int64_t>(window.column);
    const auto top = static_cast<std::int64_t>(window.row);
    const auto right = left + static_cast<std::int64_t>(window.columns);
    const auto bottom = top + static_cast<std::int64_t>(window.rows);
    for (std::size_t i = 0; i < members_.size(); ++i) {
      const Member& member = members_[i];
      const auto l = std::max(left, member.column), t = std::max(top, member.row);
      const auto r = std::min(right, member.column + static_cast<std::int64_t>(member.columns));
      const auto b = std::min(bottom, member.row + static_cast<std::int64_t>(member.rows));
      if (l >= r || t >= b) continue;
      const auto cell =
          static_cast<std::size_t>(t - top) * out.stride + static_cast<std::size_t>(l - left);
      any |= member_raster(i).read_over({.column = static_cast<std::uint64_t>(l - member.column),
                                         .row = static_cast<std::uint64_t>(t - member.row),
                                         .columns = static_cast<std::uint64_t>(r - l),
                                         .rows = static_cast<std::uint64_t>(b - t)},
                                        {.samples = out.samples + cell * size_of(info_.sample.type),
                                         .valid = out.valid + cell,
                                         .stride = out.stride});
    }
    return any;
  }

 private:
  struct Open {
    std::size_t member;
    std::unique_ptr<Raster> raster;
  };

  static constexpr std::size_t kMaxComments = 16;

  void note(std::string comment) {
    if (info_.comments.size() < kMaxComments) info_.comments.push_back(std::move(comment));
  }

  /// Determines the union's size and placement; afterwards members count from its corner.
  void unite(const RasterInfo& first, Crs crs) {
    if (crs.epsg == 0 && crs.wkt.empty() && !crs.geographic) {
      const std::string prj = prj_beside(first.files.front());
      const std::vector<char> text =
          prj.empty() ? std::vector<char>() : peek_head(prj, kMaxWkt, {});
      crs.wkt.assign(text.begin(), text.end());
    }
    const std::int64_t turn = columns_around(first.world, crs);
    if (turn > 0 && join_around(members_, first.world, turn)) {
      note("the files are on both sides of the antimeridian: longitudes go beyond 180 degrees");
    }
    std::int64_t left = INT64_MAX, top = 0, right = INT64_MIN, bottom = 0;
    for (const Member& member : members_) {
      left = std::min(left, member.column);
      top = std::min(top, member.row);
      right = std::max(right, member.column + static_cast<std::int64_t>(member.columns));
      bottom = std::max(bottom, member.row + static_cast<std::int64_t>(member.rows));
    }
    std::vector<std::string> comments = std::move(info_.comments);
    info_ = first;
    info_.comments = std::move(comments);
    info_.files = std::move(files_);
    for (Member& member : members_) {
      info_.held_bytes = std::max(info_.held_bytes, member.held_bytes);
      member.column -= left;
      member.row -= top;
    }
    info_.columns = static_cast<std::uint64_t>(right - left);
    info_.rows = static_cast<std::uint64_t>(bottom - top);
    if (info_.columns >= kMaxMosaicCells || info_.rows >= kMaxMosaicCells) {
      throw Error(members_.front().file,
                  fmt::format("the mosaic of the {} files has {} x {} cells: columns and rows must "
                              "each be fewer than 2^30",
                              members_.size(), info_.columns, info_.rows))
          .remedy("read the files separately");
    }
    auto& m = info_.world.xy;
    const auto c = static_cast<double>(left), r = static_cast<double>(top);
    m[2] = m[0] * c + m[1] * r + m[2];
    m[5] = m[3] * c + m[4] * r + m[5];
    // The blocks of several files are not aligned.
    if (members_.size() > 1) info_.block_columns = info_.block_rows = 1;
  }

  Raster& member_raster(std::size_t member) {
    const auto entry =
        std::find_if(open_.begin(), open_.end(), [&](const Open& o) { return o.member == member; });
    if (entry != open_.end()) {
      open_.splice(open_.begin(), open_, entry);
      return *open_.front().raster;
    }
    const std::uint64_t needed_bytes = members_[member].held_bytes;
    while (!open_.empty() &&
           (open_.size() >= open_at_once_ || open_held_bytes_ + needed_bytes > open_bytes_)) {
      open_held_bytes_ -= members_[open_.back().member].held_bytes;
      open_.pop_back();
    }
    open_.push_front({member, opener_(members_[member].file)});
    open_held_bytes_ += needed_bytes;
    const RasterInfo& info = open_.front().raster->info();
    if (info.columns != members_[member].columns || info.rows != members_[member].rows ||
        info.sample.type != info_.sample.type) {
      throw Error(members_[member].file, "changed while it was read")
          .remedy("read it again when it is complete");
    }
    return *open_.front().raster;
  }

  RasterOpener opener_;
  std::size_t open_at_once_;
  std::uint64_t open_bytes_, open_held_bytes_ = 0;
  RasterInfo info_;
  std::vector<std::string> files_, notes_;  ///< for info_, until it is complete
  std::vector<Member> members_;
  std::list<Open> open_;  // most recently used first
};

}  // namespace

std::unique_ptr<Raster> open_mosaic(const std::vector<std::string>& files,
                                    const RasterOpener& opener, const std::optional<Crs>& crs,
                                    std::size_t open_at_once, std::uint64_t open_bytes,
                                    const SameCrs& same_crs) {
  return std::make_unique<Mosaic>(files, opener, crs, open_at_once, open_bytes, same_crs);
}

}  // namespace terrace::stream
