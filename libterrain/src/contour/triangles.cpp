// SPDX-License-Identifier: Apache-2.0
#include "contour/triangles.hpp"

#include <algorithm>
#include <bit>
#include <tuple>
#include <utility>
#include <vector>

#include <terrace/base/random.hpp>

namespace terrace::terrain {

ContourTriangles::ContourTriangles(double interval, std::function<void(ContourLine&&)> emit,
                                   OpenLineLimit limit, bool by_rows)
    : levels_(interval, by_rows), joiner_(std::move(emit), std::move(limit)) {}

std::size_t ContourTriangles::Hash::operator()(const ContourCrossing& c) const {
  // Adding 0 turns -0 into 0, which is equal to it.
  const auto bits = [](double v) { return std::bit_cast<std::uint64_t>(v + 0.0); };
  std::uint64_t hash = static_cast<std::uint64_t>(c.level) * 0x9E3779B97F4A7C15U;
  hash = std::rotl(hash ^ bits(c.a[0]), 29) * 0xBF58476D1CE4E5B9U;
  hash = std::rotl(hash ^ bits(c.a[1]), 29) * 0x94D049BB133111EBU;
  hash = std::rotl(hash ^ bits(c.b[0]), 29) * 0xBF58476D1CE4E5B9U;
  return base::splitmix64(hash ^ bits(c.b[1]));
}

void ContourTriangles::join(std::span<const Triangle> triangles) {
  const auto crossing = [&](std::int64_t level, const Corner& p, const Corner& q) {
    return std::pair(ContourCrossing(level, p.place, q.place, std::min(p.part, q.part)),
                     levels_.place(level, p.place, p.height, q.place, q.height));
  };
  for (const Triangle& t : triangles) {
    ContourLevels::cross(
        t[0], t[1], t[2],
        [&](std::int64_t level, const Corner& apex, const Corner& right, const Corner& left) {
          const auto [from, from_place] = crossing(level, apex, right);
          const auto [to, to_place] = crossing(level, apex, left);
          joiner_.add(from, from_place, to, to_place);
        });
  }
}

void ContourTriangles::add(std::span<const Triangle> triangles) {
  join(triangles);
  end_part();
}

void ContourTriangles::add(const PartLines& part) {
  for (const PartLines::Line& line : part.lines) {
    const std::span<const Point2> points(part.points.data() + line.begin, line.end - line.begin);
    if (line.open == PartLines::kClosed) {
      joiner_.pass_closed(line.level, points);
    } else {
      const PartLines::Open& open = part.open[line.open];
      joiner_.add({open.from, open.to, points, open.number, open.last});
    }
  }
  joiner_.end_of_stretches(part.open.size());
  end_part();
}

void ContourTriangles::end_part() {
  joiner_.emit_complete([&](const ContourCrossing& c) { return c.last > part_; });
  ++part_;
}

void ContourTriangles::finish(std::span<const Triangle> triangles) {
  join(triangles);
  joiner_.emit_complete([](const ContourCrossing&) { return false; });
}

void ContourTriangles::sort(std::span<Triangle> triangles) {
  for (Triangle& t : triangles) {
    const auto smallest = std::min_element(
        t.begin(), t.end(), [](const Corner& a, const Corner& b) { return a.place < b.place; });
    std::rotate(t.begin(), smallest, t.end());
  }
  // Triangles are large, so sort keys; most differ in their first corners.
  struct Key {
    Point2 first;
    std::uint32_t number;
  };
  std::vector<Key> order;
  order.reserve(triangles.size());
  for (const Triangle& t : triangles) {
    order.push_back({t[0].place, static_cast<std::uint32_t>(order.size())});
  }
  std::sort(order.begin(), order.end(), [&](const Key& p, const Key& q) {
    if (p.first != q.first) return p.first < q.first;
    const Triangle &s = triangles[p.number], &t = triangles[q.number];
    return std::tie(s[1].place, s[2].place) < std::tie(t[1].place, t[2].place);
  });
  std::vector<Triangle> sorted;
  sorted.reserve(triangles.size());
  for (const Key& key : order) sorted.push_back(triangles[key.number]);
  std::copy(sorted.begin(), sorted.end(), triangles.begin());
}

}  // namespace terrace::terrain
