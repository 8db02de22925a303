// SPDX-License-Identifier: Apache-2.0
#include "earth/crs/operation_choice.hpp"

#include "base/units.hpp"

namespace terrace::terrain {
namespace {

using List = ProjOwned<PJ_OBJ_LIST>;

/// Returns the candidates, best first.
List candidates(const PJ* from, const PJ* to, const std::optional<GeographicArea>& area) {
  PJ_CONTEXT* const context = proj_context();
  const ProjOwned<PJ_OPERATION_FACTORY_CONTEXT> factory(
      proj_create_operation_factory_context(context, nullptr));
  PJ_OPERATION_FACTORY_CONTEXT* const f = factory.get();
  proj_operation_factory_context_set_grid_availability_use(context, f,
                                                           PROJ_GRID_AVAILABILITY_USED_FOR_SORTING);
  proj_operation_factory_context_set_spatial_criterion(context, f,
                                                       PROJ_SPATIAL_CRITERION_PARTIAL_INTERSECTION);
  if (area) {
    proj_operation_factory_context_set_area_of_interest(context, f, area->west, area->south,
                                                        area->east, area->north);
  }
  List list(proj_create_operations(context, from, to, f));
  check_proj_database();
  return list;
}

ProjObject candidate(const List& list, int i) {
  return ProjObject(proj_list_get(proj_context(), list.get(), i));
}

int size_of(const List& list) { return list == nullptr ? 0 : proj_list_get_count(list.get()); }

/// Returns the first grid that is not installed. Returns an empty string if all are installed, or
/// if PROJ does not distribute the grid.
std::string missing_grid(const PJ* operation) {
  PJ_CONTEXT* const context = proj_context();
  const int count = proj_coordoperation_get_grid_used_count(context, operation);
  for (int i = 0; i < count; ++i) {
    const char *name = nullptr, *url = nullptr;
    int available = 0;
    proj_coordoperation_get_grid_used(context, operation, i, &name, nullptr, nullptr, &url, nullptr,
                                      nullptr, &available);
    if (available == 0) return text_of(url).empty() ? std::string() : text_of(name);
  }
  return {};
}

/// Whether the operation is valid in the whole area.
bool covers(const PJ* operation, const std::optional<GeographicArea>& area) {
  if (!area) return true;
  double west = 0, south = 0, east = 0, north = 0;
  if (proj_get_area_of_use(proj_context(), operation, &west, &south, &east, &north, nullptr) == 0) {
    return false;
  }
  const auto within = [&](double longitude) {
    return west <= east ? west <= longitude && longitude <= east
                        : west <= longitude || longitude <= east;
  };
  return within(area->west) && within(area->east) && south <= area->south && area->north <= north;
}

bool is_ballpark(const PJ* operation) {
  return proj_coordoperation_has_ballpark_transformation(proj_context(), operation) != 0;
}

void choose(const List& list, bool with_grids, OperationChoice& choice) {
  PJ_CONTEXT* const context = proj_context();
  for (int i = 0; i < size_of(list) && !choice.found; ++i) {
    const ProjObject one = candidate(list, i);
    if (is_ballpark(one.get()) || proj_coordoperation_is_instantiable(context, one.get()) == 0) {
      continue;
    }
    if (!with_grids && proj_coordoperation_get_grid_used_count(context, one.get()) > 0) continue;
    const ProjObject normal(proj_normalize_for_visualization(context, one.get()));
    const char* const text = normal != nullptr
                                 ? proj_as_proj_string(context, normal.get(), PJ_PROJ_5, nullptr)
                                 : nullptr;
    if (text == nullptr) continue;
    choice.found = true;
    choice.pipeline = text;
    choice.name = text_of(proj_get_name(one.get()));
    choice.accuracy = proj_coordoperation_get_accuracy(context, one.get());
  }
}

}  // namespace

OperationChoice choose_operation(const PJ* from, const PJ* to,
                                 const std::optional<GeographicArea>& area) {
  OperationChoice choice;
  if (from == nullptr || to == nullptr) return choice;
  List list = candidates(from, to, area);
  choose(list, true, choice);
  if (!choice.found && area) {
    // No operation is valid in the whole area. A grid has no values outside its area, but a formula
    // does.
    list = candidates(from, to, std::nullopt);
    choose(list, false, choice);
    if (!choice.found) choose(list, true, choice);
  }
  double best = choice.accuracy;
  for (int i = 0; i < size_of(list); ++i) {
    const ProjObject one = candidate(list, i);
    const double accuracy = proj_coordoperation_get_accuracy(proj_context(), one.get());
    if (accuracy < 0 || (best >= 0 && accuracy >= best) || is_ballpark(one.get()) ||
        !covers(one.get(), area)) {
      continue;
    }
    const std::string grid = missing_grid(one.get());
    if (grid.empty()) continue;
    best = accuracy;
    choice.better = quoted_with_accuracy(text_of(proj_get_name(one.get())), accuracy) +
                    " lacks the grid " + grid;
  }
  check_proj_database();
  return choice;
}

std::string quoted_with_accuracy(const std::string& name, double accuracy) {
  return '"' + name + '"' + (accuracy > 0 ? " within " + plain_number(accuracy) + " m" : "");
}

}  // namespace terrace::terrain
