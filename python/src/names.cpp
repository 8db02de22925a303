// SPDX-License-Identifier: Apache-2.0
#include "names.hpp"

#include "arrays.hpp"

namespace terrace::python {

tri::Interpolation interpolation_named(const std::string& name) {
  using tri::Interpolation;
  return named<Interpolation>(name, "method",
                              {{"linear", Interpolation::kLinear},
                               {"natural", Interpolation::kNaturalNeighbour},
                               {"nearest", Interpolation::kNearest}});
}

tri::TinQuality quality_named(const std::string& name) {
  using tri::TinQuality;
  return named<TinQuality>(name, "quality",
                           {{"greedy", TinQuality::kGreedy},
                            {"removal", TinQuality::kRemoval},
                            {"fitted", TinQuality::kFitted}});
}

tri::PointDuplicates duplicates_named(const std::string& name) {
  using tri::PointDuplicates;
  return named<PointDuplicates>(name, "duplicates",
                                {{"all", PointDuplicates::kAll},
                                 {"min", PointDuplicates::kMin},
                                 {"max", PointDuplicates::kMax},
                                 {"mean", PointDuplicates::kMean},
                                 {"first", PointDuplicates::kFirst},
                                 {"error", PointDuplicates::kError}});
}

tri::Smoothing smoothing_named(const std::string& name) {
  using tri::Smoothing;
  return named<Smoothing>(name, "method",
                          {{"laplacian", Smoothing::kLaplacian},
                           {"taubin", Smoothing::kTaubin},
                           {"bilateral", Smoothing::kBilateral}});
}

terrain::Fill fill_named(const std::string& name) {
  using terrain::Fill;
  return named<Fill>(
      name, "fill",
      {{"none", Fill::none}, {"flat", Fill::flat}, {"interpolate", Fill::interpolate}});
}

cluster::Effort effort_named(const std::string& name) {
  using cluster::Effort;
  return named<Effort>(name, "effort",
                       {{"fast", Effort::fast},
                        {"default", Effort::standard},
                        {"fine", Effort::fine},
                        {"full", Effort::full}});
}

cluster::FacilityStrategy strategy_named(const std::string& name) {
  using cluster::FacilityStrategy;
  return named<FacilityStrategy>(name, "method",
                                 {{"fast", FacilityStrategy::fast},
                                  {"automatic", FacilityStrategy::automatic},
                                  {"full-scan", FacilityStrategy::full_scan},
                                  {"quadtree", FacilityStrategy::quadtree},
                                  {"octree", FacilityStrategy::octree},
                                  {"kd-tree", FacilityStrategy::kd_tree},
                                  {"facilities", FacilityStrategy::facilities},
                                  {"interchange", FacilityStrategy::interchange},
                                  {"jain-vazirani", FacilityStrategy::jain_vazirani},
                                  {"greedy-stars", FacilityStrategy::greedy_stars}});
}

}  // namespace terrace::python
