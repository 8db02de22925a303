// SPDX-License-Identifier: Apache-2.0
#include "geomorph.hpp"

#include "terrace/tri/thinned_delaunay2.hpp"

namespace terrace::tri {

#ifdef TERRACE_TRI_CORE
template class Geomorph<Delaunay2<std::int32_t>>;
template class Geomorph<ThinnedDelaunay2>;
#else
template class Geomorph<Delaunay2<double>>;
template class Geomorph<DynamicSurface<double>>;
#endif

}  // namespace terrace::tri
