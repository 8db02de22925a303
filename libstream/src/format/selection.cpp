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

bool is_kept(const std::string& name, const Selection& wanted) {
  const auto among = [&](const std::vector<std::string>& names) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  return (!wanted.keep || among(*wanted.keep)) && !among(wanted.drop);
}

class SelectedSource final : public PointSource {
 public:
  /// kept: attributes by number, in the order in which they are delivered.
  SelectedSource(std::unique_ptr<PointSource> source, const SourceOptions& options,
                 const std::vector<std::size_t>& kept)
      : source_(std::move(source)), block_points_(options.block_points) {
    const SourceInfo& all = source_->info();
    const Selection& wanted = options.selection;
    info_ = all;
    region_ = wanted.region;
    if (region_) {
      const std::array<double, 2> tolerance = border_tolerance(all);
      for (std::size_t axis = 0; axis < 2; ++axis) {
        region_->min[axis] -= tolerance[axis];
        region_->max[axis] += tolerance[axis];
      }
    }
    covers_ = wanted.covers;
    if (!wanted.where.empty()) where_.emplace(wanted.where, all);
    if (where_ || region_) {
      if (!all.grid) info_.points.reset();
      for (std::size_t i = 0; i < all.attributes.size(); ++i) {
        if (all.attributes[i].name == "withheld" && size_of(all.attributes[i].type) == 1) {
          withheld_attribute_ = i;
        }
      }
    }
    info_.attributes.clear();
    for (const std::size_t i : kept) {
      info_.attributes.push_back(all.attributes[i]);
      const std::size_t from = all.attribute_offset(i), bytes = size_of(all.attributes[i].type);
      if (!pieces_.empty() && pieces_.back().from + pieces_.back().bytes == from) {
        pieces_.back().bytes += bytes;
      } else {
        pieces_.push_back({from, bytes});
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
    std::swap(block, rest_);
    rest_.clear();
    while (block.size() < block_points_ && source_->next(read_)) {
      append(block);
      if (info_.grid && !block.empty()) break;
    }
    if (block.size() > block_points_) {
      const auto record = info_.payload_size();
      const auto points = static_cast<std::ptrdiff_t>(block_points_);
      const auto bytes = static_cast<std::ptrdiff_t>(block_points_ * record);
      rest_.positions.assign(block.positions.begin() + points, block.positions.end());
      rest_.payload.assign(block.payload.begin() + bytes, block.payload.end());
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
  /// Bytes of a record that are kept.
  struct Piece {
    std::size_t from = 0, bytes = 0;
  };

  /// Appends the selected points of the block in read_.
  void append(PointBlock& block) {
    const std::size_t from_bytes = source_->info().payload_size(), to_bytes = info_.payload_size();
    matches_.assign(read_.size(), 1);
    if (where_) where_->test(read_.positions, read_.payload, matches_);
    if (region_) {
      for (std::size_t i = 0; i < read_.size(); ++i) {
        if (matches_[i] == 0) continue;
        const Point3 place = world_point(source_->info(), read_.positions[i]);
        if (!region_->contains(place) || (covers_ && !covers_({place[0], place[1]}))) {
          matches_[i] = 0;
        }
      }
    }
    const std::size_t before = block.payload.size();
    block.payload.resize(before + read_.size() * to_bytes);
    std::byte* to = block.payload.data() + before;
    for (std::size_t i = 0; i < read_.size(); ++i) {
      if (matches_[i] == 0) {
        ++excluded_;
        continue;
      }
      const std::byte* const record = read_.payload.data() + i * from_bytes;
      if (withheld_attribute_) {
        withheld_ +=
            record[source_->info().attribute_offset(*withheld_attribute_)] != std::byte{0} ? 1 : 0;
      }
      block.positions.push_back(read_.positions[i]);
      for (const Piece& piece : pieces_) {
        std::memcpy(to, record + piece.from, piece.bytes);
        to += piece.bytes;
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
  PointBlock read_, rest_;
  std::vector<std::uint8_t> matches_;
  std::uint64_t delivered_ = 0, excluded_ = 0, withheld_ = 0;
};

}  // namespace

std::unique_ptr<PointSource> with_attributes(std::unique_ptr<PointSource> source,
                                             const std::vector<std::string>& names,
                                             std::size_t block_points) {
  std::vector<std::size_t> kept;
  const std::vector<Channel>& attributes = source->info().attributes;
  for (const std::string& name : names) {
    for (std::size_t i = 0; i < attributes.size(); ++i) {
      if (attributes[i].name == name) kept.push_back(i);
    }
  }
  return std::make_unique<SelectedSource>(std::move(source),
                                          SourceOptions{.block_points = block_points}, kept);
}

std::vector<std::string> needed_attributes(const SourceInfo& info, const Selection& wanted) {
  std::optional<Where> where;
  if (!wanted.where.empty()) where.emplace(wanted.where, info);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < info.attributes.size(); ++i) {
    const std::string& name = info.attributes[i].name;
    if (is_kept(name, wanted) || (where && where->uses(i))) names.push_back(name);
  }
  return names;
}

void check_attributes(const std::vector<std::string>& names, const std::vector<Channel>& attributes,
                      const std::string& file) {
  for (const std::string& name : names) {
    const bool known = std::any_of(attributes.begin(), attributes.end(),
                                   [&](const Channel& c) { return c.name == name; });
    if (known) continue;
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
  const Selection& wanted = options.selection;
  if (wanted.where.empty() && !wanted.keep && wanted.drop.empty() && !wanted.region) return source;
  const SourceInfo& all = source->info();
  const std::string file = all.files.empty() ? std::string() : all.files.front();
  // A chain of files has already checked and dropped these attributes.
  if (all.files.size() <= 1 || all.grid) check_attributes(wanted.drop, all.attributes, file);
  if (wanted.keep) check_attributes(*wanted.keep, all.attributes, file);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < all.attributes.size(); ++i) {
    if (is_kept(all.attributes[i].name, wanted)) kept.push_back(i);
  }
  return std::make_unique<SelectedSource>(std::move(source), options, kept);
}

}  // namespace terrace::stream
