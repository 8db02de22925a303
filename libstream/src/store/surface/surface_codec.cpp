// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "store/codec/bytes.hpp"
#include "store/codec/coding.hpp"
#include "store/codec/tables.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/stored_surface.hpp"

namespace terrace::stream {

using namespace store;

namespace {

using Triangle = std::array<std::uint32_t, 3>;

constexpr char kMark[] = "terrace surface\n";
constexpr std::size_t kMarkBytes = sizeof kMark - 1;
constexpr std::uint32_t kVersion = 1;
/// Mark, version, points, vertices, triangles, bytes of the tables.
constexpr std::size_t kHeadBytes = kMarkBytes + 4 + 4 + 4 + 8 + 4;
/// A triangle takes at least this part of a byte.
constexpr std::uint64_t kMaxTrianglesPerByte = 64;

/// Bits of a double that are not stored of an error.
constexpr unsigned kErrorShift = 44;
constexpr std::uint64_t kInfiniteError = std::uint64_t{0x7ff} << (52 - kErrorShift);

std::uint64_t code_of_error(double error) {
  const auto bits = std::bit_cast<std::uint64_t>(error);
  return (bits + (std::uint64_t{1} << kErrorShift) - 1) >> kErrorShift;
}
double error_of_code(std::uint64_t code) { return std::bit_cast<double>(code << kErrorShift); }

/// Returns the context's step of a number's class, 0 to 7.
constexpr unsigned step_of(unsigned number_class) {
  constexpr std::array<unsigned, 7> kFirst{1, 3, 5, 9, 16, 22, 30};
  unsigned step = 0;
  while (step < kFirst.size() && number_class >= kFirst[step]) ++step;
  return step;
}
constexpr unsigned kSteps = 8;

/// Contexts: those of a list of vertices that remain of a cluster; then twice, for level 0 and for
/// those above, those of moves and of fans.
constexpr unsigned kRepresentative = 0, kRemaining = 1, kRemainingStep = 2, kClusterContexts = 3;
constexpr unsigned kMove = 0, kError = kMove + kSteps, kFans = kError + kSteps, kApex = kFans + 1,
                   kLength = kApex + kSteps, kFirst = kLength + 1, kNext = kFirst + kSteps,
                   kPerKind = kNext + kSteps;
constexpr unsigned kContexts = kClusterContexts + 2 * kPerKind;

/// Triangles around an apex, each of which shares an edge with the next: apex, corners[i],
/// corners[i + 1].
struct Fan {
  std::uint32_t apex = 0;
  std::vector<std::uint32_t> corners;
};

/// Returns the triangles as fans around the apexes, their first corners, in ascending order.
/// Replaces the order of `triangles`.
std::vector<Fan> fans_of(std::span<Triangle> triangles) {
  std::sort(triangles.begin(), triangles.end());
  std::vector<Fan> fans;
  std::vector<bool> used;
  for (std::size_t begin = 0, end = 0; begin < triangles.size(); begin = end) {
    const std::uint32_t apex = triangles[begin][0];
    while (end < triangles.size() && triangles[end][0] == apex) ++end;
    const std::span<Triangle> around = triangles.subspan(begin, end - begin);
    used.assign(around.size(), false);
    const auto follow = [&](std::size_t first) {
      Fan fan{apex, {around[first][1]}};
      for (std::size_t i = first; i < around.size();) {
        used[i] = true;
        fan.corners.push_back(around[i][2]);
        i = 0;
        while (i < around.size() && (used[i] || around[i][1] != fan.corners.back())) ++i;
      }
      fans.push_back(std::move(fan));
    };
    // Those without a triangle before them, then those in circles.
    for (std::size_t i = 0; i < around.size(); ++i) {
      const bool begins = std::none_of(around.begin(), around.end(), [&](const Triangle& other) {
        return other[2] == around[i][1];
      });
      if (begins && !used[i]) follow(i);
    }
    for (std::size_t i = 0; i < around.size(); ++i) {
      if (!used[i]) follow(i);
    }
  }
  return fans;
}

/// Codes a surface cluster by cluster, in either direction.
class SurfaceCodec {
 public:
  SurfaceCodec(const ClusterOrder& order, StoredSurface& surface)
      : order_(order), surface_(surface), remaining_(order.clusters.size()) {}

  /// Finds what remains of each cluster, and sorts the triangles by clusters.
  void prepare() {
    const std::uint32_t points = order_.points();
    if (surface_.parents.size() != points || surface_.errors.size() != points ||
        surface_.levels.size() != points) {
      throw std::invalid_argument("a surface does not have the points of the store");
    }
    for (const Triangle& t : surface_.triangles) {
      if (*std::max_element(t.begin(), t.end()) >= points || t[0] == t[1] || t[1] == t[2] ||
          t[2] == t[0]) {
        throw std::invalid_argument("a triangle of the surface does not have three corners");
      }
    }
    on_surface_ = surface_.on_surface();
    leaves_.resize(points);
    for (std::uint32_t c = 0; c < order_.clusters.size(); ++c) {
      const auto& cluster = order_.clusters[c];
      if (level_of(cluster.id) > 0) continue;
      std::fill(leaves_.begin() + cluster.begin, leaves_.begin() + cluster.end, c);
    }
    for (std::uint32_t v = 0; v < points; ++v) {
      if (!on_surface_[v]) continue;
      ++vertices_;
      const bool moves = surface_.parents[v] != kNoNumber;
      for (std::uint32_t c = leaves_[v]; c != kNoNumber; c = order_.clusters[c].parent) {
        if (moves && level_of(order_.clusters[c].id) >= surface_.levels[v]) break;
        remaining_[c].push_back(v);
      }
    }
    triangles_.resize(order_.clusters.size());
    for (Triangle t : surface_.triangles) {
      std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
      const std::uint32_t c = home_of(t);
      // The apex is in the cluster.
      while (!contains(c, t[0])) std::rotate(t.begin(), t.begin() + 1, t.end());
      triangles_[c].push_back(t);
    }
  }
  /// For decoding.
  void expect(std::uint64_t triangles) {
    on_surface_.assign(order_.points(), false);
    triangles_left_ = triangles;
  }

  [[nodiscard]] std::uint32_t vertices() const { return vertices_; }
  [[nodiscard]] std::uint64_t triangles_left() const { return triangles_left_; }

  /// Codes a cluster; the clusters must come in order.
  template <class Coder>
  void code(std::uint32_t c, Coder& coder) {
    const auto& cluster = order_.clusters[c];
    participants_.clear();
    if (cluster.parent == kNoNumber) code_remaining(c, coder);
    if (level_of(cluster.id) == 0) {
      for (std::uint32_t v = cluster.begin; v < cluster.end; ++v) participants_.push_back(v);
    } else {
      for (std::uint32_t below = c + 1; below < cluster.next; below = order_.clusters[below].next) {
        code_remaining(below, coder);
        participants_.insert(participants_.end(), remaining_[below].begin(),
                             remaining_[below].end());
      }
    }
    code_moves(c, coder);
    code_fans(c, coder);
    if constexpr (Coder::kDecoding) std::vector<std::uint32_t>().swap(remaining_[c]);
  }

  /// Checks the surface as a whole after decoding. Throws: Damage.
  void check() const {
    if (surface_.on_surface() != on_surface_) {
      throw Damage("the corners of triangles are not the vertices of the surface");
    }
    // Errors do not decrease towards the parents; among equal ones there could be a circle.
    std::vector<std::uint32_t> seen(surface_.parents.size(), kNoNumber);
    for (std::uint32_t v = 0; v < seen.size(); ++v) {
      for (std::uint32_t at = v; at != kNoNumber && seen[at] != v; at = surface_.parents[at]) {
        if (seen[at] != kNoNumber) break;
        seen[at] = v;
        const std::uint32_t parent = surface_.parents[at];
        if (parent == kNoNumber) break;
        if (seen[parent] == v) throw Damage("vertices of the surface move in a circle");
        if (!on_surface_[parent] || !(surface_.errors[at] <= surface_.errors[parent]) ||
            surface_.levels[at] > surface_.levels[parent]) {
          throw Damage("a vertex of the surface moves onto one that is gone before it");
        }
      }
    }
  }

 private:
  [[nodiscard]] bool contains(std::uint32_t c, std::uint32_t v) const {
    return v >= order_.clusters[c].begin && v < order_.clusters[c].end;
  }
  /// The lowest cluster with two corners.
  [[nodiscard]] std::uint32_t home_of(const Triangle& t) const {
    std::uint32_t c = kNoNumber;
    std::uint32_t size = kNoNumber;
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t at = leaves_[t[k]];
      while (!contains(at, t[(k + 1) % 3])) at = order_.clusters[at].parent;
      // Of two with the same points the lower one is after the other.
      const std::uint32_t points = order_.clusters[at].end - order_.clusters[at].begin;
      if (points < size || (points == size && at > c)) {
        c = at;
        size = points;
      }
    }
    return c;
  }
  [[nodiscard]] static unsigned kind(unsigned level) {
    return kClusterContexts + (level == 0 ? 0 : kPerKind);
  }

  /// Codes the vertices that remain of a cluster, in ascending order.
  template <class Coder>
  void code_remaining(std::uint32_t c, Coder& coder) {
    const auto& cluster = order_.clusters[c];
    std::vector<std::uint32_t>& remaining = remaining_[c];
    const std::uint32_t head = cluster.representative;
    unsigned with_head =
        std::binary_search(remaining.begin(), remaining.end(), head) && head != kNoNumber ? 1 : 0;
    code_symbol(coder, kRepresentative, with_head);
    std::uint64_t others = remaining.size() - (Coder::kDecoding ? 0 : with_head);
    code_number(coder, kRemaining, others);
    if constexpr (Coder::kDecoding) {
      if (with_head > (head == kNoNumber ? 0U : 1U) || others > cluster.end - cluster.begin) {
        throw Damage("a cluster of the surface has an impossible number of vertices");
      }
    }
    std::uint64_t next = cluster.begin;
    std::size_t at = 0;
    for (std::uint64_t i = 0; i < others; ++i) {
      std::uint64_t step = 0;
      if constexpr (!Coder::kDecoding) {
        if (remaining[at] == head) ++at;
        step = remaining[at++] - next;
      }
      code_number(coder, kRemainingStep, step);
      if constexpr (Coder::kDecoding) {
        if (step >= cluster.end - next || next + step == head) {
          throw Damage("a vertex of the surface is not in its cluster");
        }
        remaining.push_back(static_cast<std::uint32_t>(next + step));
      }
      next += step + 1;
    }
    if constexpr (Coder::kDecoding) {
      if (with_head == 1) {
        remaining.insert(std::lower_bound(remaining.begin(), remaining.end(), head), head);
      }
    }
  }

  /// Codes where the vertices that do not remain move, by their places among all that take part.
  template <class Coder>
  void code_moves(std::uint32_t c, Coder& coder) {
    const unsigned level = level_of(order_.clusters[c].id);
    const unsigned first = kind(level);
    const std::vector<std::uint32_t>& remaining = remaining_[c];
    const auto count = static_cast<std::int64_t>(participants_.size());
    std::size_t found = 0;
    std::uint64_t last_error = 0;
    unsigned move_step = 0, error_step = 0;
    for (std::int64_t i = 0; i < count; ++i) {
      const std::uint32_t v = participants_[static_cast<std::size_t>(i)];
      if (found < remaining.size() && remaining[found] == v) {
        ++found;
        if constexpr (Coder::kDecoding) {
          if (order_.clusters[c].parent == kNoNumber)
            enter(v, level, kNoNumber, kInfiniteError);
          else if (level == 0)
            on_surface_[v] = true;
        }
        continue;
      }
      std::uint64_t move = 0;  // 0: not on the surface
      if constexpr (!Coder::kDecoding) {
        if (on_surface_[v]) move = zigzag(place_of(surface_.parents[v]) - i);
        if (on_surface_[v] && v == order_.clusters[c].representative) {
          throw std::invalid_argument("a representative moves while it is in its cluster");
        }
      }
      move_step = step_of(code_number(coder, first + kMove + move_step, move));
      if (move == 0 && level == 0) continue;
      std::uint64_t error = 0;
      if constexpr (!Coder::kDecoding) {
        error = zigzag(static_cast<std::int64_t>(code_of_error(surface_.errors[v]) - last_error));
      }
      error_step = step_of(code_number(coder, first + kError + error_step, error));
      last_error += static_cast<std::uint64_t>(unzigzag(error));
      if constexpr (Coder::kDecoding) {
        const std::int64_t distance = unzigzag(move);
        if (distance < -i || distance >= count - i || distance == 0 ||
            v == order_.clusters[c].representative || last_error >= kInfiniteError) {
          throw Damage("a vertex of the surface has an impossible move");
        }
        enter(v, level, participants_[static_cast<std::size_t>(i + distance)], last_error);
      }
    }
    if constexpr (Coder::kDecoding) {
      if (found != remaining.size())
        throw Damage("a vertex of the surface is not below its cluster");
    }
  }

  [[nodiscard]] std::int64_t place_of(std::uint32_t v) const {
    const auto at = std::lower_bound(participants_.begin(), participants_.end(), v);
    if (at == participants_.end() || *at != v) {
      throw std::invalid_argument("a vertex moves out of its cluster");
    }
    return at - participants_.begin();
  }

  void enter(std::uint32_t v, unsigned level, std::uint32_t parent, std::uint64_t error) {
    if (level == 0) on_surface_[v] = true;
    ++vertices_;
    surface_.parents[v] = parent;
    surface_.levels[v] = static_cast<std::uint8_t>(level);
    surface_.errors[v] = error_of_code(error);
  }

  template <class Coder>
  void code_fans(std::uint32_t c, Coder& coder) {
    const auto& cluster = order_.clusters[c];
    const unsigned first = kind(level_of(cluster.id));
    const auto points = static_cast<std::int64_t>(order_.points());
    std::vector<Fan> fans;
    if constexpr (!Coder::kDecoding) fans = fans_of(triangles_[c]);
    std::uint64_t count = fans.size();
    code_number(coder, first + kFans, count);
    std::uint64_t apex = cluster.begin;
    unsigned apex_step = 0, corner_step = 0, next_step = 0;
    for (std::uint64_t f = 0; f < count; ++f) {
      std::uint64_t step = 0, length = 0;
      const Fan* fan = nullptr;
      if constexpr (!Coder::kDecoding) {
        fan = &fans[static_cast<std::size_t>(f)];
        step = fan->apex - apex;
        length = fan->corners.size() - 2;
      }
      apex_step = step_of(code_number(coder, first + kApex + apex_step, step));
      code_number(coder, first + kLength, length);
      if constexpr (Coder::kDecoding) {
        if (step >= cluster.end - apex) throw Damage("a triangle is not in its cluster");
        if (length >= triangles_left_) throw Damage("the surface has too many triangles");
        triangles_left_ -= length + 1;
      }
      apex += step;
      std::int64_t before = static_cast<std::int64_t>(apex), two_before = -1;
      for (std::uint64_t i = 0; i < length + 2; ++i) {
        std::uint64_t difference = 0;
        if constexpr (!Coder::kDecoding) {
          difference = zigzag(std::int64_t{fan->corners[static_cast<std::size_t>(i)]} - before);
        }
        unsigned& corner = i == 0 ? corner_step : next_step;
        corner =
            step_of(code_number(coder, first + (i == 0 ? kFirst : kNext) + corner, difference));
        const std::int64_t distance = unzigzag(difference);
        if constexpr (Coder::kDecoding) {
          if (distance < -before || distance >= points - before || distance == 0 ||
              before + distance == static_cast<std::int64_t>(apex)) {
            throw Damage("a corner of a triangle does not exist");
          }
        }
        two_before = before;
        before += distance;
        if constexpr (Coder::kDecoding) {
          if (i > 0) {
            surface_.triangles.push_back({static_cast<std::uint32_t>(apex),
                                          static_cast<std::uint32_t>(two_before),
                                          static_cast<std::uint32_t>(before)});
          }
        }
      }
    }
  }

  const ClusterOrder& order_;
  StoredSurface& surface_;
  std::vector<std::vector<std::uint32_t>> remaining_;  ///< of each cluster
  std::vector<std::vector<Triangle>> triangles_;       ///< when encoding, of each cluster
  std::vector<bool> on_surface_;
  std::vector<std::uint32_t> leaves_;  ///< the cluster of level 0 of each point; for encoding
  std::uint32_t vertices_ = 0;
  std::uint64_t triangles_left_ = 0;
  std::vector<std::uint32_t> participants_;  ///< of the cluster being coded, ascending
};

/// Throws: std::invalid_argument unless errors and levels do not decrease towards the parents.
void check_surface(const StoredSurface& surface) {
  for (std::uint32_t v = 0; v < surface.parents.size(); ++v) {
    const std::uint32_t parent = surface.parents[v];
    if (parent == kNoNumber) continue;
    if (parent >= surface.parents.size() || !std::isfinite(surface.errors[v]) ||
        !(surface.errors[v] >= 0.0 && surface.errors[v] <= surface.errors[parent]) ||
        surface.levels[v] > surface.levels[parent]) {
      throw std::invalid_argument("a vertex moves onto one that is gone before it");
    }
  }
}

Bytes header_of(std::uint32_t points, std::uint32_t vertices, std::uint64_t triangles,
                const Bytes& tables, const std::vector<Bytes>& parts) {
  Bytes out(kMark, kMark + kMarkBytes);
  put(out, kVersion);
  put(out, points);
  put(out, vertices);
  put(out, triangles);
  put(out, static_cast<std::uint32_t>(tables.size()));
  out.insert(out.end(), tables.begin(), tables.end());
  for (const Bytes& part : parts) put_varint(out, part.size());
  put(out, crc32(out));
  return out;
}

StoredSurface decode(const ClusterOrder& order, ByteView bytes) {
  if (bytes.size() < kHeadBytes || !std::equal(kMark, kMark + kMarkBytes, bytes.begin())) {
    throw Damage("it is not the surface of a store");
  }
  ByteReader in(bytes);
  in.take(kMarkBytes);
  if (in.get<std::uint32_t>() != kVersion) throw Damage("the version of the surface is unknown");
  const auto points = in.get<std::uint32_t>(), vertices = in.get<std::uint32_t>();
  const auto triangles = in.get<std::uint64_t>();
  const auto table_bytes = in.get<std::uint32_t>();
  if (points != order.points() || vertices > points ||
      triangles / kMaxTrianglesPerByte > bytes.size()) {
    throw Damage("the surface has more vertices or triangles than possible");
  }
  ByteReader table_reader(in.take(table_bytes));
  Tables tables;
  tables.frequencies = read_frequencies(table_reader, kContexts);
  if (table_reader.remaining() != 0) throw Damage("bytes follow the tables");
  std::vector<std::uint64_t> sizes;
  sizes.reserve(order.clusters.size());
  for (std::size_t c = 0; c < order.clusters.size(); ++c) sizes.push_back(in.varint());
  if (in.get<std::uint32_t>() != crc32(bytes.first(in.offset() - 4))) {
    throw Damage("the checksum of the header is wrong");
  }
  const DecodingTables decoding(tables);
  StoredSurface surface(points);
  SurfaceCodec codec(order, surface);
  codec.expect(triangles);
  Bytes padded;
  for (std::uint32_t c = 0; c < order.clusters.size(); ++c) {
    const ByteView part = in.take(memory_size(sizes[c]));
    if (part.size() < 3 ||
        crc16(part.first(part.size() - 2)) != load<std::uint16_t>(part.data() + part.size() - 2)) {
      throw Damage("the checksum of a cluster is wrong");
    }
    padded.assign(kPadding, 0);
    padded.insert(padded.end(), part.begin(), part.end() - 2);
    padded.resize(padded.size() + kPadding);
    SymbolDecoder decoder(decoding.tables, ByteView(padded).subspan(kPadding, part.size() - 2));
    codec.code(c, decoder);
    if (decoder.finish() != 0) throw Damage("a cluster of the surface does not end with zero");
  }
  if (in.remaining() != 0) throw Damage("bytes follow the last cluster");
  if (codec.triangles_left() != 0 || codec.vertices() != vertices) {
    throw Damage("the vertices or triangles are not those of the header");
  }
  codec.check();
  return surface;
}

}  // namespace

std::vector<bool> StoredSurface::on_surface() const {
  std::vector<bool> used(parents.size(), false);
  for (const Triangle& triangle : triangles) {
    for (const std::uint32_t v : triangle) used[v] = true;
  }
  return used;
}

std::vector<std::byte> encode_surface(const ClusterOrder& order, const StoredSurface& surface) {
  check_surface(surface);
  StoredSurface copy = surface;
  SurfaceCodec codec(order, copy);
  codec.prepare();
  Counts counts(kContexts);
  SymbolCounter counter(counts);
  const auto clusters = static_cast<std::uint32_t>(order.clusters.size());
  for (std::uint32_t c = 0; c < clusters; ++c) codec.code(c, counter);
  Tables tables;
  for (const auto& context : counts) tables.frequencies.push_back(normalised(context));
  const EncodingTables encoding(tables);
  std::vector<Bytes> parts(clusters);
  for (std::uint32_t c = 0; c < clusters; ++c) {
    SymbolEncoder encoder(encoding.tables);
    codec.code(c, encoder);
    encoder.finish(0, parts[c]);
    put(parts[c], crc16(parts[c]));
  }
  Bytes table_bytes;
  write_frequencies(tables.frequencies, table_bytes);
  Bytes out =
      header_of(order.points(), codec.vertices(), surface.triangles.size(), table_bytes, parts);
  for (const Bytes& part : parts) out.insert(out.end(), part.begin(), part.end());
  const auto bytes = std::as_bytes(std::span(out));
  return {bytes.begin(), bytes.end()};
}

StoredSurface decode_surface(const ClusterOrder& order, std::span<const std::byte> bytes,
                             const std::string& file) {
  try {
    return decode(order, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  } catch (const Damage& damage) {
    throw Error(file, damage.what()).remedy("restore the file or rebuild the store");
  }
}

}  // namespace terrace::stream
