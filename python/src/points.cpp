// SPDX-License-Identifier: Apache-2.0
#include <cstring>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/stream/point_writer.hpp>
#include <terrace/terrain/output_kinds.hpp>
#include <terrace/terrain/point_file_crs.hpp>
#include <terrace/terrain/undeclared_voids.hpp>

#include "arrays.hpp"
#include "call.hpp"
#include "sources.hpp"

/// Reads points from files or arrays and writes them to files, without a store.

namespace terrace::python {
namespace {

/// Reads the blocks of a source, in coordinates of its CRS. Python's threads may share one.
class PointReader {
 public:
  PointReader(const py::object& source, const py::dict& arguments, unsigned threads)
      : held_(source) {
    const OpenSource open = opener_of(source);
    stream::SourceOptions options = reading_of(source, arguments, all_or(threads));
    source_ = released([&](const std::stop_token& stop) {
      options.stop = stop;
      return open(options);
    });
    type_ = record_type(source_->info());
    voids_.emplace(source_->info());
  }

  /// Returns the next records, or None at the end.
  py::object next() {
    std::vector<std::byte> records;
    bool some = false;
    {
      const py::gil_scoped_release open;
      const std::lock_guard lock(mutex_);
      some = source_->next(block_);
      if (some) {
        voids_->add(block_);
        stream::to_world(source_->info(), block_);
        const std::size_t payload = source_->info().payload_size();
        records.resize(block_.size() * (sizeof(stream::Point3) + payload));
        std::byte* to = records.data();
        for (std::size_t i = 0; i < block_.size(); ++i) {
          std::memcpy(to, block_.positions[i].data(), sizeof(stream::Point3));
          to += sizeof(stream::Point3);
          if (payload > 0) std::memcpy(to, block_.payload.data() + i * payload, payload);
          to += payload;
        }
      }
    }
    if (!some) {
      if (const stream::Message note = voids_->note(); !ended_ && !note.empty()) log_note(note);
      ended_ = true;
      return py::none();
    }
    return to_records(std::move(records), type_);
  }

  [[nodiscard]] const py::dtype& type() const { return type_; }
  [[nodiscard]] const stream::Schema& schema() const { return source_->info(); }

 private:
  py::object held_;  ///< keeps the arrays alive
  py::dtype type_;
  std::mutex mutex_;
  std::unique_ptr<stream::PointSource> source_;
  stream::PointBlock block_;
  std::optional<terrain::UndeclaredVoids> voids_;
  bool ended_ = false;
};

/// Returns (points written, points left out because a coordinate is NaN, largest rounding error).
py::tuple write_points(const py::object& source, const py::dict& arguments, const std::string& path,
                       const std::string& format, bool replace, const py::tuple& settings) {
  check_output_name(terrain::outputs::kPointFile, path, format);
  const OpenSource open = opener_of(source);
  std::uint64_t points = 0, nodata = 0;
  double rounding = 0;
  Call(settings).run([&](const terrain::Context& context) {
    stream::SourceOptions options;
    {
      const py::gil_scoped_acquire gil;
      options = reading_of(source, arguments, context.threads, context.stop);
    }
    const std::unique_ptr<stream::PointSource> from = open(options);
    const stream::SourceInfo& info = from->info();
    stream::PointHeader header{.attributes = info.attributes,
                               .crs = [&info] { return terrain::crs_of_point_file(info); },
                               .units = [&info] { return terrain::units_of_point_file(info); },
                               .lattice = lattice_of(info)};
    const auto writer = stream::open_point_writer(
        path, header,
        {.format = format, .replace = replace, .stop = context.stop, .threads = context.threads});
    if (const std::string lost = terrain::lost_height_unit(path, *writer, info); !lost.empty()) {
      context.say(lost);
    }
    stream::PointBlock block;
    const auto report = [&](bool ended) {
      if (!context.progress) return;
      const stream::Progress at = from->progress();
      context.progress(
          {.what = "points", .count = at.points, .fraction = at.fraction, .ended = ended});
    };
    terrain::UndeclaredVoids voids(info);
    while (from->next(block)) {
      context.check_stop();
      voids.add(block);
      stream::to_world(info, block);
      writer->append(block);
      report(false);
    }
    writer->finish();
    if (const stream::Message note = voids.note(); !note.empty()) context.say(note);
    report(true);
    points = writer->points();
    nodata = from->progress().nodata;
    rounding = writer->rounding();
  });
  return py::make_tuple(points, nodata, rounding);
}

}  // namespace

void bind_points(py::module_& module) {
  py::class_<PointReader>(module, "PointReader")
      .def(py::init<const py::object&, const py::dict&, unsigned>())
      .def("next", &PointReader::next)
      .def("type", &PointReader::type)
      .def("attributes", [](const PointReader& reader) { return attributes_info(reader.schema()); })
      .def("crs", [](const PointReader& reader) { return crs_info(reader.schema().crs); });
  module.def("write_points", &write_points);
}

}  // namespace terrace::python
