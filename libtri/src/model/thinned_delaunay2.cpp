// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/thinned_delaunay2.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>

#include "free_slots.hpp"
#include "terrace/tri/grid_tin.hpp"
#include "terrace/tri/point_tin.hpp"

namespace terrace::tri {
namespace {

using Point = ThinnedDelaunay2::Point;
using Step = ThinnedDelaunay2::Step;

constexpr std::int32_t kCells = Windowed::kCells;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Sides are simplified to this share of the tolerance, because the triangles next to them must be
/// within the whole of it.
constexpr double kShareOfSides = 0.7;

/// The nodes of a closed window, one bit each.
class NodeSet {
 public:
  void clear() { bits_.fill(0); }
  void add(std::int32_t x, std::int32_t y) {
    word(x, y) |= std::uint64_t{1} << (number(x, y) % 64);
  }
  [[nodiscard]] bool contains(std::int32_t x, std::int32_t y) const {
    return (bits_[number(x, y) / 64] >> (number(x, y) % 64) & 1) != 0;
  }

 private:
  static std::size_t number(std::int32_t x, std::int32_t y) {
    return static_cast<std::size_t>(y * (kCells + 1) + x);
  }
  std::uint64_t& word(std::int32_t x, std::int32_t y) { return bits_[number(x, y) / 64]; }
  std::array<std::uint64_t, ((kCells + 1) * (kCells + 1) + 63) / 64> bits_{};
};

struct WindowData : ThinnedDelaunay2::Window {
  /// Samples and gaps (see kGap) at the nodes with low <= node < low + kCells, or kNoSample.
  std::array<std::uint32_t, std::size_t{kCells} * kCells> at;
  NodeSet selected;           ///< if thinned
  std::uint32_t samples = 0;  ///< including those on all four sides
  std::uint32_t gaps = 0;     ///< in `at`
  bool to_select = false;     ///< in `selections_`

  WindowData() { at.fill(kNoSample); }
  [[nodiscard]] std::int32_t columns() const { return high[0] - low[0] + 1; }
  [[nodiscard]] std::int32_t rows() const { return high[1] - low[1] + 1; }
  /// The window consists of more than a side of its neighbours.
  [[nodiscard]] bool has_area() const { return columns() > 1 && rows() > 1; }
};

constexpr std::uint64_t window_key(std::int32_t x, std::int32_t y) {
  return static_cast<std::uint64_t>(y) << 32 | static_cast<std::uint32_t>(x);
}

}  // namespace

struct ThinnedDelaunay2::Impl {
  explicit Impl(const Point& last) : last_(last), thins_(last[0] > 0 && last[1] > 0) {}

  // Flags of a sample.
  static constexpr std::uint8_t kUsed = 1;
  /// Of level 1 or above.
  static constexpr std::uint8_t kCoarse = 2;
  /// Not a sample: a node without data that is a vertex and separates samples from missing data.
  static constexpr std::uint8_t kGap = 4;
  /// In `touched_`.
  static constexpr std::uint8_t kTouched = 8;
  /// Removed, but may still be a vertex.
  static constexpr std::uint8_t kRetired = 16;

  /// The sample of a vertex of mesh_ that was removed.
  struct Former {
    std::uint32_t sample = kNoSample;
    bool known = false, gap = false;
  };

  // ---- Windows --------------------------------------------------------------------------------

  [[nodiscard]] std::uint32_t find_window(std::int32_t wx, std::int32_t wy) const {
    const auto found = number_of_.find(window_key(wx, wy));
    return found == number_of_.end() ? kNoSample : found->second;
  }
  std::uint32_t get_window(std::int32_t wx, std::int32_t wy) {
    const auto [entry, is_new] = number_of_.try_emplace(window_key(wx, wy), 0);
    if (!is_new) return entry->second;
    std::uint32_t number = static_cast<std::uint32_t>(windows_.size());
    if (free_windows_.empty()) {
      windows_.emplace_back();
    } else {
      number = free_windows_.back();
      free_windows_.pop_back();
    }
    entry->second = number;
    windows_[number] = std::make_unique<WindowData>();
    WindowData& window = *windows_[number];
    window.low = {wx * kCells, wy * kCells};
    for (std::size_t k = 0; k < 2; ++k) window.high[k] = std::min(window.low[k] + kCells, last_[k]);
    return number;
  }
  /// The place in a window's array of the node of its half-open square.
  static std::size_t index_of(const Point& p) {
    return static_cast<std::size_t>((p[1] % kCells) * kCells + p[0] % kCells);
  }
  /// Calls visit(wx, wy) for the windows that contain a node.
  template <class Visit>
  static void for_windows_of(const Point& p, const Visit& visit) {
    const std::int32_t wx = p[0] / kCells, wy = p[1] / kCells;
    const bool left = p[0] % kCells == 0 && wx > 0, above = p[1] % kCells == 0 && wy > 0;
    visit(wx, wy);
    if (left) visit(wx - 1, wy);
    if (above) visit(wx, wy - 1);
    if (left && above) visit(wx - 1, wy - 1);
  }
  /// The sample or gap at a node, or kNoSample.
  [[nodiscard]] std::uint32_t at(const Point& p) const {
    const std::uint32_t number = find_window(p[0] / kCells, p[1] / kCells);
    return number == kNoSample ? kNoSample : windows_[number]->at[index_of(p)];
  }
  /// Calls visit(x, y, sample) for the samples and gaps of a closed window. x, y: from its low
  /// corner.
  template <class Visit>
  void for_each_in(const WindowData& window, const Visit& visit) const {
    const std::int32_t wx = window.low[0] / kCells, wy = window.low[1] / kCells;
    for (std::int32_t dy = 0; dy < 2; ++dy) {
      for (std::int32_t dx = 0; dx < 2; ++dx) {
        const std::uint32_t number = find_window(wx + dx, wy + dy);
        if (number == kNoSample) continue;
        const auto& from = windows_[number]->at;
        const std::int32_t rows = dy == 0 ? std::min(kCells, window.rows()) : 1;
        const std::int32_t columns = dx == 0 ? std::min(kCells, window.columns()) : 1;
        if ((dy == 1 && window.rows() <= kCells) || (dx == 1 && window.columns() <= kCells))
          continue;
        for (std::int32_t y = 0; y < rows; ++y) {
          for (std::int32_t x = 0; x < columns; ++x) {
            const std::uint32_t sample = from[static_cast<std::size_t>(y * kCells + x)];
            if (sample != kNoSample) visit(x + dx * kCells, y + dy * kCells, sample);
          }
        }
      }
    }
  }
  void request_selection(std::uint32_t number) {
    WindowData& window = *windows_[number];
    if (window.to_select) return;
    window.to_select = true;
    selections_.push_back(number);
  }

  // ---- Samples --------------------------------------------------------------------------------

  std::uint32_t new_sample(const Point& p, std::uint8_t flags) {
    std::uint32_t sample = static_cast<std::uint32_t>(flags_.size());
    if (free_samples_.empty()) {
      points_.push_back(p);
      heights_.push_back(kNaN);
      flags_.push_back(flags);
      vertex_of_.push_back(kNoSample);
    } else {
      sample = free_samples_.take();
      points_[sample] = p;
      heights_[sample] = kNaN;
      flags_[sample] = flags;
      vertex_of_[sample] = kNoSample;
    }
    return sample;
  }
  void free_sample(std::uint32_t sample) {
    flags_[sample] = 0;
    free_samples_.put(sample);
  }
  void touch(std::uint32_t sample) {
    if ((flags_[sample] & kTouched) != 0) return;
    flags_[sample] |= kTouched;
    touched_.push_back(sample);
  }

  Insertion insert(const Point& p) {
    const std::uint32_t home = get_window(p[0] / kCells, p[1] / kCells);
    std::uint32_t& place = windows_[home]->at[index_of(p)];
    if (place != kNoSample && (flags_[place] & kGap) == 0) return {VertexId{place}, false};
    if (place != kNoSample) {
      --windows_[home]->gaps;
      flags_[place] |= kRetired;
      retired_.push_back(place);
    }
    const std::uint32_t sample = place = new_sample(p, kUsed);
    ++samples_;
    for_windows_of(p, [&](std::int32_t wx, std::int32_t wy) {
      const std::uint32_t number = get_window(wx, wy);
      WindowData& window = *windows_[number];
      ++window.samples;
      if (window.thinned) unthin(number);
      if (!window.has_area() || window.complete) return;
      const auto all =
          static_cast<std::uint32_t>(window.columns()) * static_cast<std::uint32_t>(window.rows());
      window.complete = window.samples == all;
    });
    return {VertexId{sample}, true};
  }

  void remove(std::uint32_t sample) {
    const Point p = points_[sample];
    windows_[find_window(p[0] / kCells, p[1] / kCells)]->at[index_of(p)] = kNoSample;
    --samples_;
    flags_[sample] |= kRetired;
    retired_.push_back(sample);
    for_windows_of(p, [&](std::int32_t wx, std::int32_t wy) {
      const std::uint32_t number = find_window(wx, wy);
      WindowData& window = *windows_[number];
      --window.samples;
      window.complete = false;
      if (window.thinned) unthin(number);
      if (window.samples == 0) emptied_.push_back(number);
    });
  }

  void assign(std::uint32_t sample, double height, unsigned level) {
    const Point p = points_[sample];
    heights_[sample] = height;
    const bool coarse = level > 0;
    flags_[sample] =
        static_cast<std::uint8_t>(coarse ? flags_[sample] | kCoarse : flags_[sample] & ~kCoarse);
    touch(sample);
    for_windows_of(p, [&](std::int32_t wx, std::int32_t wy) {
      const std::uint32_t number = find_window(wx, wy);
      WindowData& window = *windows_[number];
      window.lowest = std::min(window.lowest, height);
      window.highest = std::max(window.highest, height);
      if (window.thinned) request_selection(number);
    });
  }

  void unthin(std::uint32_t number) {
    WindowData& window = *windows_[number];
    window.thinned = false;
    touch_window(window);
    request_neighbours(window);
  }
  void touch_window(const WindowData& window) {
    for_each_in(window, [&](std::int32_t x, std::int32_t y, std::uint32_t sample) {
      if ((flags_[sample] & kCoarse) != 0 || vertex_of_[sample] != kNoSample ||
          (window.thinned && window.selected.contains(x, y)))
        touch(sample);
    });
  }

  // ---- Thinning -------------------------------------------------------------------------------

  /// Calls visit(number) for the thinned windows that share a side with this one.
  template <class Visit>
  void for_thinned_neighbours(const WindowData& window, const Visit& visit) const {
    const std::int32_t wx = window.low[0] / kCells, wy = window.low[1] / kCells;
    for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
      const std::uint32_t number =
          wx + dx < 0 || wy + dy < 0 ? kNoSample : find_window(wx + dx, wy + dy);
      if (number != kNoSample && windows_[number]->thinned) visit(number);
    }
  }
  void request_neighbours(const WindowData& window) {
    for_thinned_neighbours(window, [&](std::uint32_t number) { request_selection(number); });
  }

  void set_step(std::uint32_t number, Step step) {
    WindowData& window = *windows_[number];
    assert(window.complete && window.has_area());
    if (window.thinned && window.step == step) return;
    for_thinned_neighbours(window, [&](std::uint32_t other) {
      const Step theirs = windows_[other]->step;
      const Step before = window.thinned ? std::min(theirs, window.step) : theirs;
      if (has_gaps_ || before != std::min(theirs, step)) request_selection(other);
    });
    if (!window.thinned) {
      // Samples of level 1 and above may cease to be vertices.
      window.selected.clear();
      window.thinned = true;
      touch_window(window);
    }
    window.step = step;
    request_selection(number);
  }

  /// Heights of `count` nodes from p on, NaN where there is no sample.
  std::vector<double> line(Point p, std::size_t axis, std::size_t count) const {
    std::vector<double> heights(count, kNaN);
    for (double& height : heights) {
      const std::uint32_t sample = at(p);
      if (sample != kNoSample && (flags_[sample] & kGap) == 0) height = heights_[sample];
      ++p[axis];
    }
    return heights;
  }

  /// The vertices on a side of a thinned window. axis: 0 for a row, 1 for a column. Depends only on
  /// the samples on and next to the side and on the finer of its two windows.
  std::vector<std::uint32_t> side(const WindowData& window, std::size_t axis, bool high) const {
    const std::size_t across = 1 - axis;
    const auto count = static_cast<std::size_t>(window.high[axis] - window.low[axis] + 1);
    Point first = window.low;
    if (high) first[across] = window.high[across];
    const std::vector<double> heights = line(first, axis, count);

    Point beyond = window.low;
    beyond[across] += high ? kCells : -kCells;
    const std::uint32_t other = beyond[across] < 0 || beyond[across] > last_[across]
                                    ? kNoSample
                                    : find_window(beyond[0] / kCells, beyond[1] / kCells);
    const bool shared = other != kNoSample && windows_[other]->thinned;
    const Step step = shared ? std::min(window.step, windows_[other]->step) : window.step;
    if (step == kEverySample) {
      // As settle_side() does, with the ends and the nodes where missing data begins.
      std::vector<std::uint32_t> all;
      const auto has_data = [&](std::size_t i) { return !std::isnan(heights[i]); };
      for (std::uint32_t i = 0; i < count; ++i)
        if (i == 0 || i + 1 == count || has_data(i) || has_data(i - 1) || has_data(i + 1))
          all.push_back(i);
      return all;
    }
    std::array<std::vector<double>, 2> beside;
    if (has_gaps_) {
      Point inner = first;
      inner[across] += high ? -1 : 1;
      beside[0] = line(inner, axis, count);
      if (shared) {
        Point outer = first;
        outer[across] += high ? 1 : -1;
        beside[1] = line(outer, axis, count);
      }
    }
    return settle_side<double>(heights, beside[0], beside[1], kShareOfSides * tolerance_of(step));
  }

  void select(std::uint32_t number) {
    WindowData& window = *windows_[number];
    window.to_select = false;
    if (!window.thinned) return;
    // The former vertices are examined too.
    touch_window(window);
    window.selected.clear();
    const auto columns = static_cast<std::size_t>(window.columns());
    const auto rows = static_cast<std::size_t>(window.rows());
    grid_.assign(columns * rows, kNaN);
    for_each_in(window, [&](std::int32_t x, std::int32_t y, std::uint32_t sample) {
      if ((flags_[sample] & kGap) != 0) return;
      const double height = heights_[sample];
      grid_[static_cast<std::size_t>(y) * columns + static_cast<std::size_t>(x)] = height;
      if (window.step == kEverySample) {
        window.selected.add(x, y);
        touch(sample);
      }
    });
    if (window.step == kEverySample) return;

    const GridSides sides{side(window, 0, false), side(window, 0, true), side(window, 1, false),
                          side(window, 1, true)};
    const GridWindow<double> grid{static_cast<std::uint32_t>(columns),
                                  static_cast<std::uint32_t>(rows), grid_};
    for (const std::uint32_t node : select_samples(grid, sides, tolerance_of(window.step))) {
      const auto x = static_cast<std::int32_t>(node % columns);
      const auto y = static_cast<std::int32_t>(node / columns);
      window.selected.add(x, y);
      const Point p{window.low[0] + x, window.low[1] + y};
      WindowData& home = *windows_[get_window(p[0] / kCells, p[1] / kCells)];
      std::uint32_t& sample = home.at[index_of(p)];
      if (sample == kNoSample) {
        sample = new_sample(p, kUsed | kGap);
        ++home.gaps;
      }
      touch(sample);
    }
  }

  [[nodiscard]] bool is_wanted(std::uint32_t sample) const {
    const std::uint8_t flags = flags_[sample];
    if ((flags & kRetired) != 0) return false;
    if (!thins_) return true;
    const Point p = points_[sample];
    bool in_thinned = false, selected = false;
    for_windows_of(p, [&](std::int32_t wx, std::int32_t wy) {
      const std::uint32_t number = find_window(wx, wy);
      if (number == kNoSample || !windows_[number]->thinned) return;
      const WindowData& window = *windows_[number];
      in_thinned = true;
      selected = selected || window.selected.contains(p[0] - window.low[0], p[1] - window.low[1]);
    });
    return in_thinned ? selected : (flags & (kCoarse | kGap)) == kCoarse;
  }

  /// Brings the vertices up to date. Returns the number of windows whose vertices were chosen.
  std::size_t update() {
    std::size_t chosen = 0;
    for (std::size_t i = 0; i < selections_.size(); ++i) {
      chosen += windows_[selections_[i]]->thinned ? 1 : 0;
      select(selections_[i]);
    }
    selections_.clear();

    to_remove_.clear();
    to_insert_.clear();
    for (const std::uint32_t sample : retired_) hide(sample);
    for (const std::uint32_t sample : touched_) {
      flags_[sample] &= static_cast<std::uint8_t>(~kTouched);
      if ((flags_[sample] & kRetired) != 0) continue;
      if (is_wanted(sample)) {
        if (vertex_of_[sample] == kNoSample) to_insert_.push_back(sample);
      } else {
        hide(sample);
        if ((flags_[sample] & kGap) != 0) {
          remove_gap(sample);
        }
      }
    }
    touched_.clear();
    mesh_.remove(to_remove_);
    for (const std::uint32_t sample : retired_) free_sample(sample);
    for (const std::uint32_t sample : unused_gaps_) free_sample(sample);
    retired_.clear();
    unused_gaps_.clear();

    insert_points_.clear();
    for (const std::uint32_t sample : to_insert_) insert_points_.push_back(points_[sample]);
    inserted_.resize(insert_points_.size());
    mesh_.insert(insert_points_, inserted_);
    for (std::size_t i = 0; i < to_insert_.size(); ++i) {
      const std::uint32_t sample = to_insert_[i];
      assert(inserted_[i].created);
      const std::uint32_t v = slot(inserted_[i].vertex);
      if (v >= sample_of_.size()) sample_of_.resize(mesh_.vertex_slots(), kNoSample);
      sample_of_[v] = sample;
      vertex_of_[sample] = v;
      if ((flags_[sample] & kGap) != 0) ++gaps_shown_;
    }
    free_empty_windows();
    return chosen;
  }
  void hide(std::uint32_t sample) {
    const std::uint32_t v = vertex_of_[sample];
    if (v == kNoSample) return;
    to_remove_.push_back(VertexId{v});
    vertex_of_[sample] = kNoSample;
    if ((flags_[sample] & kGap) != 0) --gaps_shown_;
    if (!journal_) return;
    // Of the vertices that had this slot since the last changes, only the first existed then.
    if (v >= former_.size()) former_.resize(mesh_.vertex_slots());
    if (former_[v].known) return;
    former_[v] = {sample, true, (flags_[sample] & kGap) != 0};
    former_slots_.push_back(v);
  }
  void remove_gap(std::uint32_t sample) {
    const Point p = points_[sample];
    const std::uint32_t number = find_window(p[0] / kCells, p[1] / kCells);
    windows_[number]->at[index_of(p)] = kNoSample;
    if (--windows_[number]->gaps == 0) emptied_.push_back(number);
    unused_gaps_.push_back(sample);
  }
  void free_empty_windows() {
    for (const std::uint32_t number : emptied_) {
      const WindowData* const window = windows_[number].get();
      if (window == nullptr || window->samples > 0 || window->gaps > 0) continue;
      number_of_.erase(window_key(window->low[0] / kCells, window->low[1] / kCells));
      windows_[number].reset();
      free_windows_.push_back(number);
    }
    emptied_.clear();
  }

  // ---- Changes --------------------------------------------------------------------------------

  void start_journal() {
    forget_former();
    journal_ = true;
    gap_triangles_ = 0;
    if (gaps_shown_ > 0) {
      for (const TriangleId triangle : mesh_.all_triangles())
        gap_triangles_ += has_gap(triangle) ? 1 : 0;
    }
    mesh_.start_journal();
  }
  void forget_former() {
    for (const std::uint32_t v : former_slots_) former_[v] = {};
    former_slots_.clear();
  }
  /// The sample that a vertex of mesh_ was at the last changes, and whether it was a gap.
  [[nodiscard]] Former former(VertexId vertex) const {
    const std::uint32_t v = slot(vertex);
    if (v < former_.size() && former_[v].known) return former_[v];
    return {sample_of_[v], true, is_gap(vertex)};
  }
  /// Translates the changes of mesh_ to samples and leaves out gaps and their triangles.
  void take_changes(Changes& changes) {
    mesh_.take_changes(changes);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < changes.removed_vertices.size(); ++i) {
      const Former was = former(changes.removed_vertices[i]);
      if (was.gap) continue;
      changes.removed_points[kept] = changes.removed_points[i];
      changes.removed_vertices[kept++] = VertexId{was.sample};
    }
    changes.removed_vertices.resize(kept);
    changes.removed_points.resize(kept);
    std::erase_if(changes.added_vertices, [&](VertexId vertex) { return is_gap(vertex); });
    for (VertexId& vertex : changes.added_vertices) vertex = VertexId{sample_of_[slot(vertex)]};

    kept = 0;
    for (std::size_t i = 0; i < changes.removed_triangles.size(); ++i) {
      std::array<VertexId, 3> corners{};
      bool gap = false;
      for (std::size_t k = 0; k < 3; ++k) {
        const Former was = former(changes.removed_corners[i][k]);
        corners[k] = VertexId{was.sample};
        gap = gap || was.gap;
      }
      gap_triangles_ -= gap ? 1 : 0;
      if (gap) continue;
      changes.removed_corners[kept] = corners;
      changes.removed_triangles[kept++] = changes.removed_triangles[i];
    }
    changes.removed_triangles.resize(kept);
    changes.removed_corners.resize(kept);
    gap_triangles_ += std::erase_if(changes.added_triangles,
                                    [&](TriangleId triangle) { return has_gap(triangle); });
    forget_former();
  }

  // ---- Reading --------------------------------------------------------------------------------

  [[nodiscard]] bool is_gap(VertexId v) const { return (flags_[sample_of_[slot(v)]] & kGap) != 0; }
  /// True if the triangle has a corner that is not a sample.
  [[nodiscard]] bool has_gap(TriangleId triangle) const {
    if (gaps_shown_ == 0) return false;
    const auto corners = mesh_.vertices(triangle);
    return is_gap(corners[0]) || is_gap(corners[1]) || is_gap(corners[2]);
  }
  /// Calls visit(triangle) for the triangles with data at a vertex of mesh_ until it returns false.
  template <class Visit>
  void for_triangles_around(VertexId v, const Visit& visit) const {
    const TriangleId first = mesh_.triangle_at(v);
    // Turns counter-clockwise, then clockwise from the start if the hull ends the turn.
    for (const std::size_t turn : {std::size_t{1}, std::size_t{2}}) {
      for (TriangleId at = first; at != kNoTriangle;) {
        if ((turn == 1 || at != first) && !has_gap(at) && !visit(at)) return;
        const auto corners = mesh_.vertices(at);
        const std::size_t i = corners[0] == v ? 0 : corners[1] == v ? 1 : 2;
        at = mesh_.neighbours(at)[(i + turn) % 3];
        if (at == first) return;
      }
    }
  }

  [[nodiscard]] std::size_t memory() const {
    std::size_t windows = 0;
    for (const auto& window : windows_) windows += window ? sizeof(WindowData) : 0;
    return mesh_.memory_bytes() + windows + points_.capacity() * sizeof(Point) +
           heights_.capacity() * sizeof(double) + flags_.capacity() +
           vertex_of_.capacity() * sizeof(std::uint32_t) + free_samples_.bytes() +
           sample_of_.capacity() * sizeof(std::uint32_t) + former_.capacity() * sizeof(Former);
  }

  Point last_;
  bool thins_;             ///< false for a raster of one row or column, which has no triangles
  bool has_gaps_ = false;  ///< a complete window has missing samples
  bool journal_ = false;
  Mesh mesh_;
  std::size_t samples_ = 0;
  std::size_t gaps_shown_ = 0;
  std::size_t gap_triangles_ = 0;  ///< while the journal is on

  std::unordered_map<std::uint64_t, std::uint32_t> number_of_;
  std::vector<std::unique_ptr<WindowData>> windows_;
  std::vector<std::uint32_t> free_windows_, selections_, emptied_;

  // By sample.
  std::vector<Point> points_;
  std::vector<double> heights_;
  std::vector<std::uint8_t> flags_;
  std::vector<std::uint32_t> vertex_of_;  ///< in mesh_, or kNoSample
  FreeSlots free_samples_;
  std::vector<std::uint32_t> touched_, retired_, unused_gaps_;
  // By vertex of mesh_.
  std::vector<std::uint32_t> sample_of_;
  std::vector<Former> former_;  ///< of vertices removed since the last changes
  std::vector<std::uint32_t> former_slots_;

  // Scratch memory.
  std::vector<double> grid_;
  std::vector<VertexId> to_remove_;
  std::vector<std::uint32_t> to_insert_;
  std::vector<Point> insert_points_;
  std::vector<Insertion> inserted_;
};

// The powers are constants, as results must not depend on a library's exp2().
double ThinnedDelaunay2::tolerance_of(Step step) {
  if (step == kEverySample) return 0.0;
  constexpr std::array<double, kStepsPerDoubling> kPowers{1.0,
                                                          1.0442737824274138,
                                                          1.0905077326652577,
                                                          1.1387886347566916,
                                                          1.189207115002721,
                                                          1.241857812073484,
                                                          1.2968395546510096,
                                                          1.3542555469368927,
                                                          1.4142135623730951,
                                                          1.4768261459394993,
                                                          1.5422108254079407,
                                                          1.6104903319492543,
                                                          1.681792830507429,
                                                          1.7562521603732995,
                                                          1.8340080864093424,
                                                          1.9152065613971474};
  const int doublings = (step + 4096) / kStepsPerDoubling - 4096 / kStepsPerDoubling;
  return std::ldexp(kPowers[static_cast<std::size_t>(step - kStepsPerDoubling * doublings)],
                    doublings);
}

Step ThinnedDelaunay2::step_of(double tolerance) {
  assert(tolerance >= 0.0);
  if (!(tolerance >= tolerance_of(kEverySample + 1))) return kEverySample;
  if (tolerance >= tolerance_of(kFewest)) return kFewest;
  int exponent = 0;
  std::frexp(tolerance, &exponent);
  auto step = static_cast<Step>(kStepsPerDoubling * (exponent - 1));
  for (int k = 1; k < kStepsPerDoubling; ++k) {
    if (tolerance_of(static_cast<Step>(step + 1)) > tolerance) break;
    ++step;
  }
  return step;
}

ThinnedDelaunay2::ThinnedDelaunay2(const Point& last) : impl_(std::make_unique<Impl>(last)) {
  assert(last[0] >= 0 && last[1] >= 0);
}
ThinnedDelaunay2::~ThinnedDelaunay2() = default;
ThinnedDelaunay2::ThinnedDelaunay2(ThinnedDelaunay2&&) noexcept = default;
ThinnedDelaunay2& ThinnedDelaunay2::operator=(ThinnedDelaunay2&&) noexcept = default;

std::vector<VertexId> ThinnedDelaunay2::build(std::span<const Point> points) {
  std::vector<Insertion> results(points.size());
  insert(points, results);
  std::vector<VertexId> samples;
  samples.reserve(points.size());
  for (const Insertion& result : results) samples.push_back(result.vertex);
  return samples;
}

void ThinnedDelaunay2::insert(std::span<const Point> points, std::span<Insertion> results,
                              VertexId) {
  assert(results.empty() || results.size() == points.size());
  const Point& last = impl_->last_;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& p = points[i];
    if (p[0] < 0 || p[0] > last[0] || p[1] < 0 || p[1] > last[1]) {
      throw std::invalid_argument("point " + std::to_string(i) + " is in column " +
                                  std::to_string(p[0]) + ", row " + std::to_string(p[1]) +
                                  "; the last column and row of the raster are " +
                                  std::to_string(last[0]) + " and " + std::to_string(last[1]));
    }
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Insertion result = impl_->insert(points[i]);
    if (!results.empty()) results[i] = result;
  }
}

void ThinnedDelaunay2::assign(VertexId sample, double height, unsigned level) {
  impl_->assign(slot(sample), height, level);
}

void ThinnedDelaunay2::remove(std::span<const VertexId> samples) {
  for (const VertexId sample : samples) impl_->remove(slot(sample));
}

void ThinnedDelaunay2::reserve(std::size_t samples) {
  impl_->points_.reserve(samples);
  impl_->heights_.reserve(samples);
  impl_->flags_.reserve(samples);
  impl_->vertex_of_.reserve(samples);
}

std::uint32_t ThinnedDelaunay2::window_slots() const {
  return static_cast<std::uint32_t>(impl_->windows_.size());
}

const ThinnedDelaunay2::Window* ThinnedDelaunay2::window(std::uint32_t number) const {
  const WindowData* const window = impl_->windows_[number].get();
  return window != nullptr && window->samples > 0 && window->has_area() ? window : nullptr;
}

void ThinnedDelaunay2::set_complete(std::uint32_t window) {
  impl_->windows_[window]->complete = true;
  impl_->has_gaps_ = true;
}

std::size_t ThinnedDelaunay2::thin(std::span<const Target> targets) {
  for (const Target& target : targets) impl_->set_step(target.window, target.step);
  return impl_->update();
}

bool ThinnedDelaunay2::is_in_thinned_window(TriangleId triangle) const {
  Point low = impl_->last_, high{0, 0};
  for (const VertexId corner : impl_->mesh_.vertices(triangle)) {
    const Point p = impl_->mesh_.point(corner);
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  const std::uint32_t number = impl_->find_window(low[0] / kCells, low[1] / kCells);
  if (number == kNoSample) return false;
  const WindowData& window = *impl_->windows_[number];
  return window.thinned && window.step != kEverySample && high[0] <= window.high[0] &&
         high[1] <= window.high[1];
}

bool ThinnedDelaunay2::has_hidden_sample_near(double column, double row) const {
  const auto first = [](double at) { return static_cast<std::int32_t>(std::ceil(at - 1.0)); };
  const auto last = [](double at) { return static_cast<std::int32_t>(std::floor(at + 1.0)); };
  for (std::int32_t y = std::max(0, first(row)); y <= std::min(impl_->last_[1], last(row)); ++y) {
    for (std::int32_t x = std::max(0, first(column)); x <= std::min(impl_->last_[0], last(column));
         ++x) {
      const std::uint32_t sample = impl_->at({x, y});
      if (sample != kNoSample && impl_->vertex_of_[sample] == kNoSample) return true;
    }
  }
  return false;
}

std::size_t ThinnedDelaunay2::sample_count() const { return impl_->samples_; }
std::size_t ThinnedDelaunay2::vertex_count() const {
  return impl_->mesh_.vertex_count() - impl_->gaps_shown_;
}
std::size_t ThinnedDelaunay2::triangle_count() const {
  if (impl_->gaps_shown_ == 0) return impl_->mesh_.triangle_count();
  if (impl_->journal_) return impl_->mesh_.triangle_count() - impl_->gap_triangles_;
  std::size_t count = 0;
  for ([[maybe_unused]] const TriangleId triangle : all_triangles()) ++count;
  return count;
}
Point ThinnedDelaunay2::point(VertexId sample) const { return impl_->points_[slot(sample)]; }

std::array<VertexId, 3> ThinnedDelaunay2::vertices(TriangleId triangle) const {
  std::array<VertexId, 3> corners = impl_->mesh_.vertices(triangle);
  for (VertexId& corner : corners) corner = VertexId{impl_->sample_of_[slot(corner)]};
  return corners;
}

std::array<TriangleId, 3> ThinnedDelaunay2::neighbours(TriangleId triangle) const {
  std::array<TriangleId, 3> result = impl_->mesh_.neighbours(triangle);
  for (TriangleId& neighbour : result)
    if (neighbour != kNoTriangle && impl_->has_gap(neighbour)) neighbour = kNoTriangle;
  return result;
}

TriangleId ThinnedDelaunay2::triangle_at(VertexId vertex) const {
  const VertexId v{impl_->vertex_of_[slot(vertex)]};
  TriangleId found = kNoTriangle;
  impl_->for_triangles_around(v, [&](TriangleId triangle) {
    found = triangle;
    return false;
  });
  return found;
}

void ThinnedDelaunay2::triangles_around(VertexId vertex, std::vector<TriangleId>& result) const {
  result.clear();
  impl_->for_triangles_around(VertexId{impl_->vertex_of_[slot(vertex)]}, [&](TriangleId triangle) {
    result.push_back(triangle);
    return true;
  });
}

std::uint32_t ThinnedDelaunay2::dense_slot(VertexId vertex) const {
  return impl_->vertex_of_[slot(vertex)];
}
std::uint32_t ThinnedDelaunay2::dense_slots() const { return impl_->mesh_.vertex_slots(); }

void ThinnedDelaunay2::adjacent(VertexId vertex, std::vector<VertexId>& result) const {
  impl_->mesh_.adjacent(VertexId{impl_->vertex_of_[slot(vertex)]}, result);
  std::erase_if(result, [&](VertexId other) { return impl_->is_gap(other); });
  for (VertexId& other : result) other = VertexId{impl_->sample_of_[slot(other)]};
}

std::uint32_t ThinnedDelaunay2::vertex_slots() const {
  return static_cast<std::uint32_t>(impl_->flags_.size());
}
std::uint32_t ThinnedDelaunay2::triangle_slots() const { return impl_->mesh_.triangle_slots(); }
bool ThinnedDelaunay2::alive(VertexId vertex) const {
  const std::uint32_t sample = slot(vertex);
  return sample < impl_->flags_.size() && impl_->vertex_of_[sample] != kNoSample &&
         (impl_->flags_[sample] & Impl::kGap) == 0;
}
bool ThinnedDelaunay2::alive(TriangleId triangle) const {
  return impl_->mesh_.alive(triangle) && !impl_->has_gap(triangle);
}
std::uint64_t ThinnedDelaunay2::hash() const { return impl_->mesh_.hash(); }
std::size_t ThinnedDelaunay2::memory_bytes() const { return impl_->memory(); }

void ThinnedDelaunay2::start_journal() {
  impl_->update();
  impl_->start_journal();
}

void ThinnedDelaunay2::take_changes(Changes& changes) {
  impl_->update();
  impl_->take_changes(changes);
}

}  // namespace terrace::tri
