// SPDX-License-Identifier: Apache-2.0
#include "multiresolution.hpp"

#include "terrace/tri/thinned_delaunay2.hpp"
#ifndef TERRACE_TRI_CORE
#include "terrace/tri/regional_delaunay2.hpp"
#endif

namespace terrace::tri {

#ifdef TERRACE_TRI_CORE
template class MultiresolutionModel<Delaunay2<std::int32_t>>;
template class MultiresolutionModel<ThinnedDelaunay2>;
template class MultiresolutionModel<PointCloud>;
#else
template class MultiresolutionModel<Delaunay2<double>>;
template class MultiresolutionModel<Delaunay3<std::int32_t>>;
template class MultiresolutionModel<Delaunay3<double>>;
template class MultiresolutionModel<DynamicSurface<double>>;
template class MultiresolutionModel<RegionalDelaunay2<std::int32_t>>;
template class MultiresolutionModel<RegionalDelaunay2<double>>;
template class MultiresolutionModel<Delaunay2<double, EllipticalMetric2>>;
template class MultiresolutionModel<Delaunay3<double, EllipticalMetric3>>;
#endif

}  // namespace terrace::tri
