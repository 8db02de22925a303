// SPDX-License-Identifier: Apache-2.0
#include "geomorph.hpp"

namespace terrace::tri {

#ifdef TERRACE_TRI_CORE
template class Geomorph<Delaunay2<std::int32_t>>;
#else
template class Geomorph<Delaunay2<double>>;
template class Geomorph<DynamicSurface<double>>;
#endif

}  // namespace terrace::tri
