// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "base/available_memory.hpp"
#include "base/parallel.hpp"
#include "sample/samplers.hpp"

namespace terrace::terrain {
namespace {

/// Places that a thread handles at a time.
constexpr std::size_t kPlacesPerTask = 8192;

/// Samples a raster with focuses of level 0: where all samples around a place are wanted, on the
/// lattice, which knows gaps and is faster, and elsewhere on the triangulation of mixed levels.
class FocusedSampler final : public HeightSampler {
 public:
  FocusedSampler(std::shared_ptr<SampledCloud> sampled, const SamplerOptions& options,
                 const Context& context)
      : sampled_(std::move(sampled)), threads_(std::max(1U, context.threads)), stop_(context.stop) {
    Context half = context;
    half.memory_bytes = kProcessBytes + working_memory(context) / 2;
    SamplerOptions on_lattice = options;
    on_lattice.max_edge.reset();
    lattice_ = make_lattice_sampler(sampled_->store, on_lattice, half);
    points_ = make_point_sampler(sampled_, options, half);
  }

  void sample(std::span<const Point2> places, std::span<SurfacePoint> out) override {
    constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();
    masked_.assign(places.begin(), places.end());
    in_tasks(places.size(), [&](std::size_t i) {
      if (!sampled_->is_lattice(places[i])) masked_[i] = {kNowhere, kNowhere};
    });
    lattice_->sample(masked_, out);
    others_.resize(places.size());
    in_tasks(places.size(), [&](std::size_t i) {
      const bool is_answered = masked_[i][0] == places[i][0] && masked_[i][1] == places[i][1];
      masked_[i] = is_answered ? Point2{kNowhere, kNowhere} : places[i];
    });
    points_->sample(masked_, others_);
    in_tasks(places.size(), [&](std::size_t i) {
      if (masked_[i][0] == places[i][0] && masked_[i][1] == places[i][1]) out[i] = others_[i];
    });
  }

 private:
  template <class Work>
  void in_tasks(std::size_t count, const Work& work) const {
    parallel_for((count + kPlacesPerTask - 1) / kPlacesPerTask, threads_,
                 [&](std::size_t task) {
                   const std::size_t end = std::min((task + 1) * kPlacesPerTask, count);
                   for (std::size_t i = task * kPlacesPerTask; i < end; ++i) work(i);
                 },
                 stop_);
  }

  std::shared_ptr<SampledCloud> sampled_;
  unsigned threads_;
  std::stop_token stop_;
  std::unique_ptr<HeightSampler> lattice_, points_;
  std::vector<Point2> masked_;  ///< the places of one sampler; those of the other are NaN
  std::vector<SurfacePoint> others_;
};

}  // namespace

std::unique_ptr<HeightSampler> make_cloud_sampler(std::shared_ptr<SampledCloud> cloud,
                                                  const SamplerOptions& options,
                                                  const Context& context) {
  if (cloud->store.schema().grid && cloud->cloud.wanted.finest() == 0) {
    return std::make_unique<FocusedSampler>(std::move(cloud), options, context);
  }
  return make_point_sampler(std::move(cloud), options, context);
}

}  // namespace terrace::terrain
