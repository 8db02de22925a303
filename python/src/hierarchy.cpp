// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/cluster/hierarchy.hpp>
#include <terrace/terrain/metric_choice.hpp>

#include "arrays.hpp"
#include "call.hpp"
#include "names.hpp"

namespace terrace::python {
namespace {

template <class T>
std::vector<T> copy_of(std::span<const T> from) {
  return {from.begin(), from.end()};
}

/// Passes finished blocks, as dicts of arrays, to a Python function.
class CallSink final : public cluster::HierarchySink {
 public:
  explicit CallSink(const py::function& take) : take_(take) {}

  std::unique_ptr<Prepared> prepare(const cluster::ClusteredBlock& block) override {
    return std::make_unique<Copy>(block);
  }
  void commit(unsigned, std::unique_ptr<Prepared> prepared) override {
    call(static_cast<Copy&>(*prepared));
  }
  void root(const cluster::ClusteredBlock& block) override {
    Copy copy(block);
    call(copy);
  }

 private:
  struct Copy final : Prepared {
    explicit Copy(const cluster::ClusteredBlock& block)
        : level(block.level),
          number(block.block),
          points(copy_of(block.positions)),
          payload(copy_of(block.payload)),
          children(copy_of(block.children)),
          first(copy_of(block.first)),
          order(copy_of(block.order)),
          representatives(copy_of(block.representatives)) {
      for (const cluster::ClusterSummary& of : block.summaries) {
        boxes.push_back({of.box.min[0], of.box.min[1], of.box.min[2], of.box.max[0], of.box.max[1],
                         of.box.max[2]});
        errors.push_back(of.error);
        descendants.push_back(of.descendants);
      }
    }
    unsigned level;
    std::uint64_t number;
    std::vector<cluster::Point3> points;
    std::vector<std::byte> payload;
    std::vector<std::uint64_t> children;
    std::vector<std::uint32_t> first, order, representatives;
    std::vector<std::array<double, 6>> boxes;
    std::vector<double> errors;
    std::vector<std::uint64_t> descendants;
  };

  void call(Copy& of) {
    const py::gil_scoped_acquire gil;
    py::dict block;
    block["level"] = of.level;
    block["number"] = of.number;
    block["points"] = to_array(std::move(of.points));
    block["values"] = to_records(std::move(of.payload), py::dtype("u1"));
    block["children"] = to_array(std::move(of.children));
    block["first"] = to_array(std::move(of.first));
    block["order"] = to_array(std::move(of.order));
    block["representatives"] = mark_missing(of.representatives, cluster::kNoRepresentative);
    block["boxes"] = to_array(std::move(of.boxes));
    block["errors"] = to_array(std::move(of.errors));
    block["descendants"] = to_array(std::move(of.descendants));
    take_(block);
  }

  const py::function& take_;
};

/// Releases the interpreter's lock while the builder waits for its threads, which may call Python.
struct Builder {
  Builder(cluster::HierarchyOptions options, cluster::HierarchySink& sink)
      : work(std::make_unique<cluster::HierarchyBuilder>(std::move(options), sink)) {}
  ~Builder() {
    const py::gil_scoped_release open;
    work.reset();
  }
  Builder(const Builder&) = delete;
  Builder& operator=(const Builder&) = delete;

  std::unique_ptr<cluster::HierarchyBuilder> work;
};

/// batches: pairs of points (n, 3) and their payload (n, bytes).
py::dict stream_clusters(const py::iterable& batches, const py::function& take,
                         const py::dict& arguments) {
  cluster::HierarchyOptions options;
  const auto set = [&](const char* name, auto& to) { take_option(arguments, name, to); };
  set("bytes", options.payload_size);
  set("block_points", options.block_size);
  set("facility_cost", options.block.facility_cost);
  set("k", options.medians);
  set("batch", options.batch);
  set("search_threads", options.search_threads);
  set("seed", options.block.seed);
  set("threads", options.threads);
  options.threads = all_or(options.threads);
  take_named(arguments, "effort", options.block.effort);
  take_named(arguments, "method", options.strategy);
  options.metric = terrain::MetricChoice::parse(arguments["metric"].cast<std::string>())
                       .on_ground({}, cluster::kIdentityMap);
  CallSink sink(take);
  Builder builder(std::move(options), sink);
  for (const py::handle batch : batches) {
    const auto [points, payload] = batch.cast<std::pair<Array<double>, Array<std::uint8_t>>>();
    const auto places = rows_of<3>(points, "points");
    const std::span<const std::uint8_t> bytes(payload.data(),
                                              static_cast<std::size_t>(payload.size()));
    const py::gil_scoped_release open;
    builder.work->push(places, std::as_bytes(bytes));
  }
  const cluster::HierarchyResult solution = released([&] { return builder.work->finish(); });
  py::dict result;
  result["points"] = solution.points;
  result["top"] = solution.top;
  result["level_points"] = solution.level_points;
  result["level_clusters"] = solution.level_clusters;
  return result;
}

}  // namespace

void bind_hierarchy(py::module_& module) { module.def("stream_clusters", &stream_clusters); }

}  // namespace terrace::python
