// SPDX-License-Identifier: Apache-2.0
#include "format/selection.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/where.hpp"

namespace terrace::stream {
namespace {

bool is_selected(const std::string& name, const SourceOptions& options) {
  const Selection& selection = options.selection;
  const auto among = [&](const std::vector<std::string>& names) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const bool kept =
      !selection.keep || among(*selection.keep) || is_shape_column(name, options.entities);
  return kept && !among(selection.drop);
}

/// Delivers the selected points of a source, with the selected attributes.
class SelectedSource final : public PointSource {
 public:
  /// selected: the numbers of the attributes to deliver, in their order.
  SelectedSource(std::unique_ptr<PointSource> source, const SourceOptions& options,
                 const std::vector<std::size_t>& selected)
      : source_(std::move(source)), block_points_(options.block_points) {
    const SourceInfo& source_info = source_->info();
    const Selection& selection = options.selection;
    info_ = source_info;
    region_ = selection.region;
    if (region_) {
      const std::array<double, 2> tolerance = border_tolerance(source_info);
      for (std::size_t axis = 0; axis < 2; ++axis) {
        region_->min[axis] -= tolerance[axis];
        region_->max[axis] += tolerance[axis];
      }
    }
    covers_ = selection.covers;
    if (!selection.where.empty()) where_.emplace(selection.where, source_info);
    if (where_ || region_) {
      if (!source_info.grid) info_.points.reset();
      for (std::size_t i = 0; i < source_info.attributes.size(); ++i) {
        if (source_info.attributes[i].name == "withheld" &&
            size_of(source_info.attributes[i].type) == 1) {
          withheld_attribute_ = i;
        }
      }
    }
    info_.attributes.clear();
    for (const std::size_t i : selected) {
      info_.attributes.push_back(source_info.attributes[i]);
      const std::size_t offset = source_info.attribute_offset(i),
                        bytes = size_of(source_info.attributes[i].type);
      if (!pieces_.empty() && pieces_.back().offset + pieces_.back().bytes == offset) {
        pieces_.back().bytes += bytes;
      } else {
        pieces_.push_back({offset, bytes});
      }
    }
  }

  const SourceInfo& info() const override { return info_; }
  void refine(double cell_aspect, std::uint64_t memory_bytes) override {
    source_->refine(cell_aspect, memory_bytes);
  }
  std::uint64_t reading_bytes() const override { return source_->reading_bytes(); }

  bool next(PointBlock& block) override {
    block.clear();
    // Begin with the points left over from the last call.
    std::swap(block, pending_);
    pending_.clear();
    while (block.size() < block_points_ && source_->next(input_)) {
      append(block);
      if (info_.grid && !block.empty()) break;
    }
    if (block.size() > block_points_) {
      const auto record = info_.payload_size();
      const auto points = static_cast<std::ptrdiff_t>(block_points_);
      const auto bytes = static_cast<std::ptrdiff_t>(block_points_ * record);
      pending_.positions.assign(block.positions.begin() + points, block.positions.end());
      pending_.payload.assign(block.payload.begin() + bytes, block.payload.end());
      block.positions.resize(block_points_);
      block.payload.resize(block_points_ * record);
    }
    delivered_ += block.size();
    return !block.empty();
  }

  Progress progress() const override {
    Progress progress = source_->progress();
    progress.points = delivered_;
    progress.excluded += excluded_;
    if (withheld_attribute_) progress.withheld = withheld_;
    return progress;
  }

 private:
  /// Contiguous bytes of a record that are delivered.
  struct Piece {
    std::size_t offset = 0, bytes = 0;
  };

  /// Appends the selected points of the block in read_.
  void append(PointBlock& block) {
    const std::size_t from_bytes = source_->info().payload_size(), to_bytes = info_.payload_size();
    matches_.assign(input_.size(), 1);
    if (where_) where_->test(input_.positions, input_.payload, matches_);
    if (region_) {
      for (std::size_t i = 0; i < input_.size(); ++i) {
        if (matches_[i] == 0) continue;
        const Point3 place = world_point(source_->info(), input_.positions[i]);
        if (!region_->contains(place) || (covers_ && !covers_({place[0], place[1]}))) {
          matches_[i] = 0;
        }
      }
    }
    const std::size_t before = block.payload.size();
    block.payload.resize(before + input_.size() * to_bytes);
    std::byte* target = block.payload.data() + before;
    for (std::size_t i = 0; i < input_.size(); ++i) {
      if (matches_[i] == 0) {
        ++excluded_;
        continue;
      }
      const std::byte* const record = input_.payload.data() + i * from_bytes;
      if (withheld_attribute_) {
        withheld_ +=
            record[source_->info().attribute_offset(*withheld_attribute_)] != std::byte{0} ? 1 : 0;
      }
      block.positions.push_back(input_.positions[i]);
      for (const Piece& piece : pieces_) {
        std::memcpy(target, record + piece.offset, piece.bytes);
        target += piece.bytes;
      }
    }
    block.payload.resize(block.size() * to_bytes);
  }

  std::unique_ptr<PointSource> source_;
  std::size_t block_points_;
  SourceInfo info_;
  std::optional<Where> where_;
  std::optional<Box3> region_;
  std::function<bool(const std::array<double, 2>&)> covers_;
  std::vector<Piece> pieces_;
  std::optional<std::size_t> withheld_attribute_;
  PointBlock input_, pending_;
  std::vector<std::uint8_t> matches_;
  std::uint64_t delivered_ = 0, excluded_ = 0, withheld_ = 0;
};

}  // namespace

std::unique_ptr<PointSource> with_attributes(std::unique_ptr<PointSource> source,
                                             const std::vector<std::string>& names,
                                             std::size_t block_points) {
  std::vector<std::size_t> selected;
  const std::vector<Channel>& attributes = source->info().attributes;
  for (const std::string& name : names) {
    for (std::size_t i = 0; i < attributes.size(); ++i) {
      if (attributes[i].name == name) selected.push_back(i);
    }
  }
  return std::make_unique<SelectedSource>(std::move(source),
                                          SourceOptions{.block_points = block_points}, selected);
}

std::vector<std::string> needed_attributes(const SourceInfo& info, const SourceOptions& options) {
  const Selection& selection = options.selection;
  std::optional<Where> where;
  if (!selection.where.empty()) where.emplace(selection.where, info);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < info.attributes.size(); ++i) {
    const std::string& name = info.attributes[i].name;
    if (is_selected(name, options) || (where && where->uses(i))) names.push_back(name);
  }
  return names;
}

void check_attributes(const std::vector<std::string>& names, const std::vector<Channel>& attributes,
                      const std::string& file) {
  for (const std::string& name : names) {
    const bool exists = std::any_of(attributes.begin(), attributes.end(),
                                    [&](const Channel& c) { return c.name == name; });
    if (exists) continue;
    std::string list;
    for (const Channel& attribute : attributes) {
      if (!list.empty()) list += ", ";
      list += attribute.name;
    }
    throw Error(file, "its points have no attribute " + in_quotes(name))
        .remedy(list.empty() ? "they have no attributes" : "known are " + list);
  }
}

std::unique_ptr<PointSource> selection_of(std::unique_ptr<PointSource> source,
                                          const SourceOptions& options) {
  const Selection& selection = options.selection;
  if (selection.where.empty() && !selection.keep && selection.drop.empty() && !selection.region)
    return source;
  const SourceInfo& source_info = source->info();
  const std::string file = source_info.files.empty() ? std::string() : source_info.files.front();
  // A chain of files has already checked and dropped these attributes.
  if (source_info.files.size() <= 1 || source_info.grid)
    check_attributes(selection.drop, source_info.attributes, file);
  if (selection.keep) check_attributes(*selection.keep, source_info.attributes, file);
  std::vector<std::size_t> selected;
  for (std::size_t i = 0; i < source_info.attributes.size(); ++i) {
    if (is_selected(source_info.attributes[i].name, options)) selected.push_back(i);
  }
  return std::make_unique<SelectedSource>(std::move(source), options, selected);
}

}  // namespace terrace::stream
