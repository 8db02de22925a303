// SPDX-License-Identifier: GPL-3.0-or-later
// Requests a GPU, so the CUDA runtime must link if the library uses it.
#include <terrace/cluster/linkage.hpp>

int main() {
  const std::vector<terrace::cluster::Point3> points{{0, 0, 0}, {3, 4, 0}};
  const auto cuda = terrace::cluster::cuda_available();
  if (!cuda.available && cuda.reason.empty()) return 1;
  return terrace::cluster::complete_linkage(points).merges.at(0).height == 5.0 ? 0 : 1;
}
