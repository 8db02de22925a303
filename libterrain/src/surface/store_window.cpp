// SPDX-License-Identifier: Apache-2.0
#include "surface/store_window.hpp"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <limits>
#include <utility>

namespace terrace::terrain {
namespace {

constexpr std::uint64_t kInnerBytes = std::uint64_t{4} << 20;

StoredBox flat(const stream::Box3& box) {
  return {{box.min[0], box.min[1]}, {box.max[0], box.max[1]}};
}

}  // namespace

StoreWindow::StoreWindow(const stream::Store& store, std::uint64_t cache_bytes)
    : store_(store),
      leaves_{.most_bytes = cache_bytes},
      inner_{.most_bytes = kInnerBytes},
      wanted_(store.top() + 1) {
  fill(root_, store.root());
}

void StoreWindow::fill(Node& node, stream::ClusterId id) {
  const unsigned level = stream::level_of(id);
  store_.read(id, points_);
  node.id = id;
  // Not copied: the next cluster is read into what the node held before.
  std::swap(node.positions, points_.positions);
  std::swap(node.children, points_.children);
  node.boxes.clear();
  for (std::size_t i = 0; i < node.positions.size(); ++i) {
    for (unsigned below = 0; below < level; ++below) {
      const std::uint64_t ordinal = node.children[i * level + below];
      node.boxes.push_back(flat(store_.record(stream::cluster_id(below, ordinal)).summary.box));
    }
  }
  // The node itself and its entries in list and map count too.
  node.bytes = node.positions.capacity() * sizeof(stream::Point3) +
               node.children.capacity() * sizeof(std::uint64_t) +
               node.boxes.capacity() * sizeof(StoredBox) + sizeof(Node) + 64;
}

void StoreWindow::Cache::drop(Nodes& to) {
  by_id.erase(static_cast<std::uint64_t>(nodes.back().id));
  held_bytes -= nodes.back().bytes;
  to.splice(to.begin(), nodes, std::prev(nodes.end()));
}

const StoreWindow::Node& StoreWindow::node(stream::ClusterId id) {
  if (id == root_.id) return root_;
  Cache& cache = stream::level_of(id) == 0 ? leaves_ : inner_;
  if (cache.most_bytes == 0) {
    fill(passing_, id);
    return passing_;
  }
  const auto key = static_cast<std::uint64_t>(id);
  if (const auto found = cache.by_id.find(key); found != cache.by_id.end()) {
    cache.nodes.splice(cache.nodes.begin(), cache.nodes, found->second);
    return cache.nodes.front();
  }
  // A node that has to go lends its memory to the one that comes. Until that one is whole it is in
  // no map, so damage leaves nothing behind.
  Nodes fresh, gone;
  if (cache.held_bytes >= cache.most_bytes && !cache.nodes.empty()) {
    cache.drop(fresh);
  } else {
    fresh.emplace_front();
  }
  fill(fresh.front(), id);
  cache.held_bytes += fresh.front().bytes;
  cache.nodes.splice(cache.nodes.begin(), fresh);
  cache.by_id[key] = cache.nodes.begin();
  while (cache.held_bytes > cache.most_bytes && cache.nodes.size() > 1) cache.drop(gone);
  return cache.nodes.front();
}

template <class Visit>
void StoreWindow::descend(const StoredBox& box, unsigned level, const Visit& visit) {
  for (std::vector<std::uint64_t>& ordinals : wanted_) ordinals.clear();
  const auto deliver = [&](const Node& node, unsigned at) {
    visit(node, at);
    for (std::size_t i = 0; i < node.positions.size(); ++i) {
      // What a point heads on a level lies within what it heads on the level above.
      for (unsigned below = at; below-- > level;) {
        if (!node.boxes[i * at + below].meets(box)) break;
        wanted_[below].push_back(node.children[i * at + below]);
      }
    }
  };
  const unsigned top = store_.top();
  if (level > top) return;
  deliver(root_, top);
  for (unsigned at = top; at-- > level;) {
    // In order of ordinals: so are the bytes in the file.
    std::sort(wanted_[at].begin(), wanted_[at].end());
    for (const std::uint64_t ordinal : wanted_[at]) {
      deliver(node(stream::cluster_id(at, ordinal)), at);
    }
  }
}

template <class Height>
void StoreWindow::scatter(const LatticeWindow& window, std::span<Height> out, unsigned level) {
  assert(store_.schema().grid);
  assert(out.size() == window.size());
  std::fill(out.begin(), out.end(), std::numeric_limits<Height>::quiet_NaN());
  if (window.columns <= 0 || window.rows <= 0) return;
  const stream::Channel& channel = store_.schema().coordinates[2];
  const auto columns = static_cast<std::size_t>(window.columns);
  const StoredBox box{{static_cast<double>(window.column), static_cast<double>(window.row)},
                      {static_cast<double>(window.column + window.columns - 1),
                       static_cast<double>(window.row + window.rows - 1)}};
  const double scale = channel.scale, offset = channel.offset;
  descend(box, level, [&](const Node& node, unsigned) {
    for (const stream::Point3& p : node.positions) {
      if (!box.contains(p)) continue;
      const auto column = static_cast<std::size_t>(static_cast<std::int64_t>(p[0] - box.min[0]));
      const auto row = static_cast<std::size_t>(static_cast<std::int64_t>(p[1] - box.min[1]));
      out[row * columns + column] = static_cast<Height>(p[2] * scale + offset);
    }
  });
}

void StoreWindow::heights(const LatticeWindow& window, std::span<double> out, unsigned level) {
  scatter(window, out, level);
}

void StoreWindow::heights(const LatticeWindow& window, std::span<float> out, unsigned level) {
  assert(float_is_exact());
  scatter(window, out, level);
}

bool StoreWindow::float_is_exact() const {
  const stream::Channel& channel = store_.schema().coordinates[2];
  if (channel.scale != 1.0 || channel.offset != 0.0) return false;
  switch (channel.type) {
    case stream::ScalarType::i8:
    case stream::ScalarType::u8:
    case stream::ScalarType::i16:
    case stream::ScalarType::u16:
    case stream::ScalarType::f32:
      return true;
    default:
      return false;
  }
}

void StoreWindow::points(const StoredBox& box, WindowPoints& out, unsigned level) {
  out.clear();
  descend(box, level, [&](const Node& node, unsigned at) {
    for (const stream::Point3& p : node.positions) {
      if (!box.contains(p)) continue;
      out.positions.push_back(p);
      out.levels.push_back(static_cast<std::uint8_t>(at));
    }
  });
}

}  // namespace terrace::terrain
