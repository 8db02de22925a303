// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine.hpp"

namespace terrace::cluster {

template <class V>
class Engine {
 public:
  explicit Engine(BlockState& state) : s_(state) {}

  void run(const SearchPlan& plan) {
    measure_groups();
    seed();
    partition();
    for (std::uint32_t j = 0; j < s_.facility_count; ++j) recentre(j);
    if (plan.random_candidates > 0) {
      search_random(plan);
    } else {
      for (std::uint32_t round = 0; round < plan.sweeps; ++round) sweep(round, plan);
    }
    open_overpriced();
    for (std::uint32_t round = 0; round < plan.polish; ++round) {
      if (round > 0) partition();
      for (std::uint32_t j = 0; j < s_.facility_count; ++j) recentre(j);
    }
    s_.sort_facilities();
    assign();
  }

 private:
  using Mask = typename V::Mask;

  static V squared(V x, V y, V z, V cx, V cy, V cz) {
    const V dx = x - cx;
    const V dy = y - cy;
    const V dz = z - cz;
    return dx * dx + dy * dy + dz * dz;
  }

  /// Gives every point to its nearest facility and makes the segments anew.
  void partition() {
    assign();
    s_.build_segments();
    for (std::uint32_t j = 0; j < s_.facility_count; ++j) summarise(j);
  }

  void measure_groups() {
    s_.group_count = round_to_lanes(s_.count) / kLanes;
    for (std::uint32_t g = 0; g < s_.group_count; ++g) {
      const V x = V::load(s_.x + g * kLanes);
      const V y = V::load(s_.y + g * kLanes);
      const V z = V::load(s_.z + g * kLanes);
      s_.group_x[g] = 0.5f * (least(x) + largest(x));
      s_.group_y[g] = 0.5f * (least(y) + largest(y));
      s_.group_z[g] = 0.5f * (least(z) + largest(z));
      s_.group_radius[g] =
          root(largest(squared(x, y, z, V::broadcast(s_.group_x[g]), V::broadcast(s_.group_y[g]),
                               V::broadcast(s_.group_z[g]))));
    }
  }

  // The square root that all paths share.
  static float root(float value) { return largest(sqrt(V::broadcast(value))); }

  /// Sum of w d over runs of `length` points, d being measured from the run's centre of mass.
  /// length: a multiple of sixteen.
  float run_cost(std::uint32_t length) {
    const std::uint32_t end = round_to_lanes(s_.count);
    V total = V::broadcast(0);
    for (std::uint32_t first = 0; first < end; first += length) {
      const std::uint32_t last = first + length < end ? first + length : end;
      V sw = V::broadcast(0);
      V sx = sw;
      V sy = sw;
      V sz = sw;
      for (std::uint32_t i = first; i < last; i += kLanes) {
        const V w = V::load(s_.w + i);
        sw = sw + w;
        sx = sx + w * V::load(s_.x + i);
        sy = sy + w * V::load(s_.y + i);
        sz = sz + w * V::load(s_.z + i);
      }
      const float weight = sum(sw);
      const float inverse = weight > 0 ? 1.0f / weight : 0.0f;
      const V cx = V::broadcast(sum(sx) * inverse);
      const V cy = V::broadcast(sum(sy) * inverse);
      const V cz = V::broadcast(sum(sz) * inverse);
      for (std::uint32_t i = first; i < last; i += kLanes) {
        const V d =
            sqrt(squared(V::load(s_.x + i), V::load(s_.y + i), V::load(s_.z + i), cx, cy, cz));
        total = total + V::load(s_.w + i) * d;
      }
    }
    return sum(total);
  }

  void seed() {
    // Cost of k facilities, one for each run of `length` points of the curve, for lengths that
    // double; a parabola through the least of them and its neighbours.
    constexpr int kMost = 24;
    float total[kMost];
    float connection[kMost];
    int levels = 0;
    int best = 0;
    const float points = static_cast<float>(s_.count);
    for (std::uint32_t length = kLanes; levels < kMost; length *= 2) {
      connection[levels] = run_cost(length);
      total[levels] = s_.facility_cost * points / static_cast<float>(length) + connection[levels];
      if (total[levels] < total[best]) best = levels;
      ++levels;
      if (length >= s_.count || levels > best + 3) break;
    }
    float length = static_cast<float>(kLanes << best);
    float count = points / length;
    if (best > 0 && best + 1 < levels) {
      const float a = total[best - 1];
      const float b = total[best];
      const float c = total[best + 1];
      const float curvature = a - 2 * b + c;
      const float shift = curvature > 0 ? 0.5f * (a - c) / curvature : 0.0f;
      // 2^-shift for |shift| <= 1/2
      count *= 1.0f + shift * (-0.69315f + shift * (0.24023f - shift * 0.0555f));
      const float growth =
          connection[best - 1] > 0 ? connection[best + 1] / connection[best - 1] : 4;
      float factor = 0.7f + 0.3f * (growth - 2.3f) / 0.73f;
      factor = factor < 0.7f ? 0.7f : factor > 1.0f ? 1.0f : factor;
      count *= factor;
    }
    if (best == 0 && levels > 1 && connection[0] > 0) {
      // Below sixteen points per run the growth is taken to go on.
      const float growth = connection[1] / connection[0];
      float runs = connection[0];
      float least_total = total[0];
      while (growth > 1 && length > 1) {
        runs /= growth;
        const float next = s_.facility_cost * 2 * count + runs;
        if (!(next < least_total)) break;
        least_total = next;
        length *= 0.5f;
        count *= 2;
      }
    }
    auto wanted = static_cast<std::uint32_t>(count + 0.5f);
    wanted = wanted < 1 ? 1 : wanted > s_.count ? s_.count : wanted;
    s_.facility_count = 0;
    s_.reserve_facilities(wanted + wanted / 2);
    for (std::uint32_t k = 0; k < wanted; ++k) {
      s_.add_facility(
          static_cast<std::uint32_t>((std::uint64_t{2} * k + 1) * s_.count / (2 * wanted)));
    }
  }

  /// Nearest facility of every point; ties go to the lowest number.
  void assign() {
    const std::uint32_t end = round_to_lanes(s_.facility_count);
    const V step = V::broadcast(1.0e-6f);
    for (std::uint32_t g = 0; g < s_.group_count; ++g) {
      const V cx = V::broadcast(s_.group_x[g]);
      const V cy = V::broadcast(s_.group_y[g]);
      const V cz = V::broadcast(s_.group_z[g]);
      V low = V::broadcast(3.0e38f);
      for (std::uint32_t j = 0; j < end; j += kLanes) {
        const V d = squared(V::load(s_.fx + j), V::load(s_.fy + j), V::load(s_.fz + j), cx, cy, cz);
        d.store(s_.scratch + j);
        low = min(low, d);
      }
      // A point of the group is nearest to a facility within this distance of the centre.
      const float bound = root(least(low)) + 2 * s_.group_radius[g];
      const V limit = V::broadcast(bound * bound * 1.00001f) + step * step;
      const std::uint32_t i = g * kLanes;
      const V x = V::load(s_.x + i);
      const V y = V::load(s_.y + i);
      const V z = V::load(s_.z + i);
      V best = V::broadcast(3.0e38f);
      V number = V::broadcast(0);
      for (std::uint32_t j = 0; j < end; j += kLanes) {
        std::uint32_t bits = less(V::load(s_.scratch + j), limit).bits();
        while (bits != 0) {
          const std::uint32_t k = j + static_cast<std::uint32_t>(__builtin_ctz(bits));
          bits &= bits - 1;
          const V d = squared(x, y, z, V::broadcast(s_.fx[k]), V::broadcast(s_.fy[k]),
                              V::broadcast(s_.fz[k]));
          const Mask nearer = less(d, best);
          best = min(d, best);
          number = select(nearer, V::broadcast(static_cast<float>(k)), number);
        }
      }
      sqrt(best).store(s_.distance + i);
      number.store_as_integers(s_.nearest + i);
    }
  }

  /// What the pruning needs to know of facility j, from its segment.
  void summarise(std::uint32_t j) {
    V load = V::broadcast(0);
    V spent = load;
    V far = load;
    V sx = load;
    V sy = load;
    V sz = load;
    const std::uint32_t end = s_.begin[j] + round_to_lanes(s_.size[j]);
    for (std::uint32_t i = s_.begin[j]; i < end; i += kLanes) {
      const V w = V::load(s_.pw + i);
      const V d = V::load(s_.pd + i);
      load = load + w;
      spent = spent + w * d;
      far = max(far, d);
      sx = sx + w * V::load(s_.px + i);
      sy = sy + w * V::load(s_.py + i);
      sz = sz + w * V::load(s_.pz + i);
    }
    set_summary(j, sum(load), sum(spent), largest(far), sum(sx), sum(sy), sum(sz));
  }

  void set_summary(std::uint32_t j, float load, float spent, float furthest, float sx, float sy,
                   float sz) {
    s_.load[j] = load;
    s_.spent[j] = spent;
    s_.furthest[j] = furthest;
    const float inverse = load > 0 ? 1.0f / load : 0.0f;
    s_.mean_x[j] = sx * inverse;
    s_.mean_y[j] = sy * inverse;
    s_.mean_z[j] = sz * inverse;
    // Beyond twice the longest connection no client is nearer to the candidate. Closing loses at
    // least load * D - 2 * spent (triangle inequality), which must stay below the facility cost.
    const float closing = (s_.facility_cost + 2 * spent) * inverse;
    const float far = 2 * furthest > closing ? 2 * furthest : closing;
    s_.reach[j] = load > 0 ? far * far * 1.00001f : kFarAway * kFarAway;
  }

  /// Moves facility j to the client nearest to the median of its clients, if that is cheaper.
  void recentre(std::uint32_t j) {
    const std::uint32_t first = s_.begin[j];
    const std::uint32_t end = first + round_to_lanes(s_.size[j]);
    float cx = s_.mean_x[j];
    float cy = s_.mean_y[j];
    float cz = s_.mean_z[j];
    // One step of Weiszfeld's iteration from the mean.
    {
      V sw = V::broadcast(0);
      V sx = sw;
      V sy = sw;
      V sz = sw;
      const V tiny = V::broadcast(1e-6f + 0.05f * s_.furthest[j]);
      for (std::uint32_t i = first; i < end; i += kLanes) {
        const V x = V::load(s_.px + i);
        const V y = V::load(s_.py + i);
        const V z = V::load(s_.pz + i);
        const V d = sqrt(squared(x, y, z, V::broadcast(cx), V::broadcast(cy), V::broadcast(cz)));
        const V w = V::load(s_.pw + i) / max(d, tiny);
        sw = sw + w;
        sx = sx + w * x;
        sy = sy + w * y;
        sz = sz + w * z;
      }
      const float weight = sum(sw);
      if (!(weight > 0)) return;
      cx = sum(sx) / weight;
      cy = sum(sy) / weight;
      cz = sum(sz) / weight;
    }
    V best = V::broadcast(3.0e38f);
    V place = V::broadcast(0);
    V here = V::iota() + V::broadcast(static_cast<float>(first));
    const V lanes = V::broadcast(static_cast<float>(kLanes));
    for (std::uint32_t i = first; i < end; i += kLanes) {
      const V d = squared(V::load(s_.px + i), V::load(s_.py + i), V::load(s_.pz + i),
                          V::broadcast(cx), V::broadcast(cy), V::broadcast(cz));
      const Mask nearer = less(d, best);
      best = select(nearer, d, best);
      place = select(nearer, here, place);
      here = here + lanes;
    }
    const float closest = least(best);
    // Surplus lanes lie where the facility is; should one win, nothing changes.
    const Mask others = less(V::broadcast(closest), best);
    const float where = least(select(others, V::broadcast(3.0e38f), place));
    const auto chosen = static_cast<std::uint32_t>(where);
    if (chosen >= first + s_.size[j]) return;
    const float x = s_.px[chosen];
    const float y = s_.py[chosen];
    const float z = s_.pz[chosen];
    V spent = V::broadcast(0);
    V far = spent;
    for (std::uint32_t i = first; i < end; i += kLanes) {
      const V w = V::load(s_.pw + i);
      const V d = sqrt(squared(V::load(s_.px + i), V::load(s_.py + i), V::load(s_.pz + i),
                               V::broadcast(x), V::broadcast(y), V::broadcast(z)));
      const V counted = select(less(V::broadcast(0), w), d, V::broadcast(0));
      counted.store(s_.scratch_pool + i - first);
      spent = spent + w * d;
      far = max(far, counted);
    }
    const float cost = sum(spent);
    if (!(cost < s_.spent[j])) return;
    for (std::uint32_t i = first; i < end; i += kLanes) {
      V::load(s_.scratch_pool + i - first).store(s_.pd + i);
    }
    s_.facility[j] = static_cast<std::uint32_t>(s_.pp[chosen]);
    s_.fx[j] = x;
    s_.fy[j] = y;
    s_.fz[j] = z;
    const float load = s_.load[j];
    set_summary(j, load, cost, largest(far), s_.mean_x[j] * load, s_.mean_y[j] * load,
                s_.mean_z[j] * load);
  }

  /// What opening a facility at (x, y, z) spares. Fills near and closes.
  float gain(float x, float y, float z) {
    const V cx = V::broadcast(x);
    const V cy = V::broadcast(y);
    const V cz = V::broadcast(z);
    const V zero = V::broadcast(0);
    const std::uint32_t facilities = round_to_lanes(s_.facility_count);
    std::uint32_t count = 0;
    for (std::uint32_t j = 0; j < facilities; j += kLanes) {
      const V d = squared(V::load(s_.fx + j), V::load(s_.fy + j), V::load(s_.fz + j), cx, cy, cz);
      std::uint32_t bits = less(d, V::load(s_.reach + j)).bits();
      while (bits != 0) {
        s_.near[count++] = j + static_cast<std::uint32_t>(__builtin_ctz(bits));
        bits &= bits - 1;
      }
    }
    s_.near_count = count;
    float gain = -s_.facility_cost;
    V spared = zero;
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint32_t j = s_.near[k];
      const std::uint32_t first = s_.begin[j];
      const std::uint32_t end = first + round_to_lanes(s_.size[j]);
      // Closing j loses at least load * |candidate - mean| - spent: distance is convex.
      const float mx = s_.mean_x[j] - x;
      const float my = s_.mean_y[j] - y;
      const float mz = s_.mean_z[j] - z;
      const float mean_loss = s_.facility_cost + s_.spent[j];
      const float load = s_.load[j];
      s_.closes[k] = 0;
      if (load * load * (mx * mx + my * my + mz * mz) < mean_loss * mean_loss) {
        V lost = zero;
        for (std::uint32_t i = first; i < end; i += kLanes) {
          const V d =
              sqrt(squared(V::load(s_.px + i), V::load(s_.py + i), V::load(s_.pz + i), cx, cy, cz));
          const V change = (V::load(s_.pd + i) - d) * V::load(s_.pw + i);
          const V better = max(change, zero);
          spared = spared + better;
          lost = lost + (better - change);
        }
        const float loss = sum(lost);
        if (loss < s_.facility_cost) {
          s_.closes[k] = 1;
          gain += s_.facility_cost - loss;
        }
      } else {
        for (std::uint32_t i = first; i < end; i += kLanes) {
          const V d =
              sqrt(squared(V::load(s_.px + i), V::load(s_.py + i), V::load(s_.pz + i), cx, cy, cz));
          const V change = (V::load(s_.pd + i) - d) * V::load(s_.pw + i);
          spared = spared + max(change, zero);
        }
      }
    }
    return gain + sum(spared);
  }

  /// Opens a facility at the point; gain() for it must have been the last call.
  void open(std::uint32_t point) {
    std::uint32_t most = kLanes;
    for (std::uint32_t k = 0; k < s_.near_count; ++k) most += round_to_lanes(s_.size[s_.near[k]]);
    s_.reserve_pool(most);
    const std::uint32_t first = s_.pool_used;
    std::uint32_t out = first;
    const V cx = V::broadcast(s_.x[point]);
    const V cy = V::broadcast(s_.y[point]);
    const V cz = V::broadcast(s_.z[point]);
    const V zero = V::broadcast(0);
    for (std::uint32_t k = 0; k < s_.near_count; ++k) {
      const std::uint32_t j = s_.near[k];
      const bool closes = s_.closes[k] != 0;
      const std::uint32_t begin = s_.begin[j];
      const std::uint32_t end = begin + round_to_lanes(s_.size[j]);
      std::uint32_t kept = begin;
      bool changed = false;
      for (std::uint32_t i = begin; i < end; i += kLanes) {
        const V x = V::load(s_.px + i);
        const V y = V::load(s_.py + i);
        const V z = V::load(s_.pz + i);
        const V d = sqrt(squared(x, y, z, cx, cy, cz));
        const V old = V::load(s_.pd + i);
        const V w = V::load(s_.pw + i);
        const Mask client = less(zero, w);
        // A vector's last lanes may be surplus: they have no weight and go nowhere.
        const Mask moves = closes ? client : client & less(d, old);
        const std::uint32_t bits = moves.bits();
        if (bits == 0 && !changed) {
          kept = i + kLanes;
          continue;
        }
        const V p = V::load(s_.pp + i);
        if (bits != 0) {
          compress(s_.px + out, moves, x);
          compress(s_.py + out, moves, y);
          compress(s_.pz + out, moves, z);
          compress(s_.pw + out, moves, w);
          compress(s_.pd + out, moves, d);
          compress(s_.pp + out, moves, p);
          out += static_cast<std::uint32_t>(__builtin_popcount(bits));
        }
        if (!closes) {
          const Mask stays = client & ~moves;
          compress(s_.px + kept, stays, x);
          compress(s_.py + kept, stays, y);
          compress(s_.pz + kept, stays, z);
          compress(s_.pw + kept, stays, w);
          compress(s_.pd + kept, stays, old);
          compress(s_.pp + kept, stays, p);
          kept += static_cast<std::uint32_t>(__builtin_popcount(stays.bits()));
          changed = true;
        }
      }
      if (changed) {
        s_.size[j] = kept - begin;
        clear_surplus(kept);
        summarise(j);
      }
    }
    for (std::uint32_t k = s_.near_count; k-- > 0;) {
      if (s_.closes[k] != 0) s_.remove_facility(s_.near[k]);
    }
    const std::uint32_t j = s_.add_facility(point);
    s_.begin[j] = first;
    s_.size[j] = out - first;
    clear_surplus(out);
    s_.pool_used = first + round_to_lanes(out - first);
    summarise(j);
    recentre(j);
  }

  /// Makes the lanes from `end` to the next multiple of sixteen count for nothing.
  void clear_surplus(std::uint32_t end) {
    for (std::uint32_t i = end; i < round_to_lanes(end); ++i) {
      s_.px[i] = s_.py[i] = s_.pz[i] = s_.pw[i] = s_.pd[i] = 0;
    }
  }

  void consider(std::uint32_t point) {
    if (gain(s_.x[point], s_.y[point], s_.z[point]) > 0) open(point);
  }

  /// Considers points at equal distances along the curve, about three per facility or more.
  void sweep(std::uint32_t round, const SearchPlan& plan) {
    std::uint32_t spacing = s_.count / (3 * s_.facility_count);
    spacing = plan.spacing * (spacing < 1 ? 1 : spacing > kLanes ? kLanes : spacing);
    const std::uint32_t visits = (s_.count + spacing - 1) / spacing;
    // In steps near the golden section of their number, so that what a change has touched is
    // seldom judged right afterwards.
    auto step = static_cast<std::uint32_t>(static_cast<float>(visits) * 0.618034f);
    if (step == 0) step = 1;
    while (common_divisor(step, visits) != 1) ++step;
    const std::uint32_t offset = (spacing / 2 + 5 * round) % spacing;
    std::uint32_t visit = 0;
    for (std::uint32_t k = 0; k < visits; ++k) {
      const std::uint32_t point = visit * spacing + offset;
      consider(point < s_.count ? point : s_.count - 1);
      visit = (visit + step) % visits;
    }
  }

  /// Points that pay more than a facility costs had better be one.
  void open_overpriced() {
    std::uint32_t found = 0;
    const V limit = V::broadcast(s_.facility_cost);
    for (std::uint32_t j = 0; j < s_.facility_count; ++j) {
      const std::uint32_t end = s_.begin[j] + round_to_lanes(s_.size[j]);
      for (std::uint32_t i = s_.begin[j]; i < end; i += kLanes) {
        const Mask overpriced = less(limit, V::load(s_.pw + i) * V::load(s_.pd + i));
        for (std::uint32_t bits = overpriced.bits(); bits != 0; bits &= bits - 1) {
          const std::uint32_t place = i + static_cast<std::uint32_t>(__builtin_ctz(bits));
          s_.nearest[found++] = static_cast<std::uint32_t>(s_.pp[place]);
        }
      }
    }
    for (std::uint32_t k = 0; k < found; ++k) consider(s_.nearest[k]);
  }

  void search_random(const SearchPlan& plan) {
    std::uint64_t state = plan.seed;
    for (std::uint32_t k = 0; k < plan.random_candidates; ++k) {
      // SplitMix64
      state += 0x9e3779b97f4a7c15u;
      std::uint64_t bits = state;
      bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
      bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
      bits ^= bits >> 31;
      consider(static_cast<std::uint32_t>(((bits >> 32) * s_.count) >> 32));
    }
  }

  static std::uint32_t common_divisor(std::uint32_t a, std::uint32_t b) {
    while (b != 0) {
      const std::uint32_t rest = a % b;
      a = b;
      b = rest;
    }
    return a;
  }

  BlockState& s_;
};

}  // namespace terrace::cluster
