// SPDX-License-Identifier: Apache-2.0
#include "format/geotiff/handle.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

namespace terrace::stream {
namespace {

constexpr std::uint64_t kMiB = 1u << 20;

std::string printed(const char* module, const char* format, va_list values) {
  std::array<char, 512> text{};
  std::vsnprintf(text.data(), text.size(), format, values);
  std::string line = text.data();
  if (module != nullptr && *module != '\0') line = std::string(module).append(": ").append(line);
  return line;
}

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

/// True for warnings that must be errors: libtiff would continue without a field that it cannot
/// read, or with blocks that have no offset, but a truncated file must not pass for a complete one.
bool is_fatal(std::string_view line) {
  return contains(line, "IO error during reading") || contains(line, "Out of memory") ||
         (contains(line, "Incorrect count") &&
          (contains(line, "Offsets\"") || contains(line, "ByteCounts\"")));
}

}  // namespace

/// The file as libtiff sees it: a descriptor and a separate position.
struct GeoTiffHandle::Io {
  int descriptor = -1;
  std::uint64_t position = 0, size = 0;

  ~Io() {
    if (descriptor >= 0) ::close(descriptor);
  }

  std::int64_t read_some(std::uint64_t offset, std::byte* out, std::uint64_t bytes) const {
    std::uint64_t done = 0;
    while (done < bytes) {
      const ssize_t n =
          ::pread(descriptor, out + done, bytes - done, static_cast<off_t>(offset + done));
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) return -1;
      if (n == 0) break;
      done += static_cast<std::uint64_t>(n);
    }
    return static_cast<std::int64_t>(done);
  }

  static tmsize_t read(thandle_t handle, void* out, tmsize_t bytes) {
    Io& io = *static_cast<Io*>(handle);
    if (bytes < 0) return -1;
    const std::uint64_t remaining = io.position < io.size ? io.size - io.position : 0;
    const std::int64_t n = io.read_some(io.position, static_cast<std::byte*>(out),
                                        std::min(static_cast<std::uint64_t>(bytes), remaining));
    if (n > 0) io.position += static_cast<std::uint64_t>(n);
    return n;
  }
  static tmsize_t write(thandle_t, void*, tmsize_t) { return -1; }
  static toff_t seek(thandle_t handle, toff_t offset, int whence) {
    Io& io = *static_cast<Io*>(handle);
    switch (whence) {
      case SEEK_SET:
        io.position = offset;
        break;
      case SEEK_CUR:
        io.position += offset;
        break;
      default:
        io.position = io.size + offset;
    }
    return io.position;
  }
  static int close(thandle_t) { return 0; }
  static toff_t size_of_file(thandle_t handle) { return static_cast<Io*>(handle)->size; }
};

int GeoTiffHandle::on_error(TIFF*, void* self, const char* module, const char* format,
                            va_list values) {
  // The first complaint names the cause; later ones are its consequences.
  auto& handle = *static_cast<GeoTiffHandle*>(self);
  if (handle.complaint_.empty()) handle.complaint_ = printed(module, format, values);
  return 1;
}

int GeoTiffHandle::on_warning(TIFF*, void* self, const char* module, const char* format,
                              va_list values) {
  auto& handle = *static_cast<GeoTiffHandle*>(self);
  const std::string line = printed(module, format, values);
  if (is_fatal(line)) {
    if (handle.complaint_.empty()) handle.complaint_ = line;
  } else if (contains(line, "ignored") && handle.warnings_.size() < 8) {
    handle.warnings_.push_back(line);
  }
  return 1;
}

GeoTiffHandle::GeoTiffHandle(const std::string& file, std::uint64_t memory_bytes)
    : file_(file), io_(std::make_unique<Io>()) {
  io_->descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (io_->descriptor < 0) throw system_error(file, "cannot be opened", errno);
  struct stat status {};
  if (::fstat(io_->descriptor, &status) != 0) throw system_error(file, "cannot be examined", errno);
  if (!S_ISREG(status.st_mode)) {
    throw fault("is not a regular file")
        .remedy("a TIFF is read out of order: save it to a file first");
  }
  if (status.st_size == 0) throw fault("is empty").remedy("download or export the file again");
  io_->size = file_bytes_ = static_cast<std::uint64_t>(status.st_size);

  // The longest arrays of a directory are the offsets and sizes of blocks: 8 bytes in memory for at
  // least 2 in the file. Codecs need at most a decoded block.
  const std::uint64_t max_array_bytes =
      std::max({memory_bytes, std::min(4 * file_bytes_ + kMiB, 1024 * kMiB), 4 * kMiB});
  const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(),
                                                                             TIFFOpenOptionsFree);
  if (options == nullptr) throw fault("cannot be opened: out of memory");
  TIFFOpenOptionsSetMaxSingleMemAlloc(
      options.get(), static_cast<tmsize_t>(std::min<std::uint64_t>(max_array_bytes, INT64_MAX)));
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), on_error, this);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), on_warning, this);
  // r: read; m: do not map; h: only the header, so that the loop below reads each directory;
  // c: leave a single large strip as it is.
  tiff_ = TIFFClientOpenExt(file.c_str(), "rmhc", io_.get(), Io::read, Io::write, Io::seek,
                            Io::close, Io::size_of_file, nullptr, nullptr, options.get());
  const std::string remedy = "check that it is a complete TIFF file (gdalinfo, tiffinfo)";
  if (tiff_ == nullptr) throw fault("is not a TIFF file: " + take_complaint()).remedy(remedy);
  try {
    for (int directory = 0;; ++directory) {
      warnings_.clear();
      const bool read = TIFFReadDirectory(tiff_) == 1;
      const std::string complaint = take_complaint();
      const std::string where = fmt::format("directory {}", directory);
      if (!read && complaint.empty())
        throw fault("has no image that is not an overview").at(where).remedy(remedy);
      if (!read || is_fatal(complaint))
        throw fault("cannot be read: " + complaint).at(where).remedy(remedy);
      if (!complaint.empty()) warnings_.push_back(complaint);
      const auto kind = value_or<std::uint32_t>(TIFFTAG_SUBFILETYPE, 0);
      if ((kind & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) == 0) break;
    }
  } catch (...) {
    TIFFClose(tiff_);
    throw;
  }
}

GeoTiffHandle::~GeoTiffHandle() { TIFFClose(tiff_); }

bool GeoTiffHandle::go_to_mask() {
  bool is_mask = false, is_image = true;
  // A damaged directory after the image must not prevent reading the image.
  while (!is_mask && is_image && TIFFLastDirectory(tiff_) == 0 && TIFFReadDirectory(tiff_) == 1) {
    const auto kind = value_or<std::uint32_t>(TIFFTAG_SUBFILETYPE, 0);
    is_mask = (kind & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) == FILETYPE_MASK;
    is_image = kind != 0;
  }
  take_complaint();
  return is_mask;
}

bool GeoTiffHandle::read(std::uint64_t offset, std::span<std::byte> out) const {
  if (offset > file_bytes_ || out.size() > file_bytes_ - offset) return false;
  const std::int64_t n = io_->read_some(offset, out.data(), out.size());
  if (n < 0) throw system_error(file_, "cannot be read", errno);
  return static_cast<std::uint64_t>(n) == out.size();
}

std::string GeoTiffHandle::take_complaint() { return std::exchange(complaint_, {}); }

std::span<const std::byte> GeoTiffHandle::field(std::uint32_t tag, int type) const {
  const TIFFField* const tag_field = TIFFFindField(tiff_, tag, TIFF_ANY);
  if (tag_field == nullptr) return {};
  // For a field that libtiff does not know it passes a 32-bit count. If the program around us has
  // registered these fields, the count may have 16 bits, or a text may have none.
  const void* data = nullptr;
  std::uint32_t count = 0;
  int found = 0;
  if (TIFFFieldPassCount(tag_field) == 0) {
    if (type != TIFF_ASCII) return {};
    found = TIFFGetField(tiff_, tag, &data);
    if (found == 1 && data != nullptr) {
      count = static_cast<std::uint32_t>(std::strlen(static_cast<const char*>(data)));
    }
  } else if (TIFFFieldReadCount(tag_field) == TIFF_VARIABLE2) {
    found = TIFFGetField(tiff_, tag, &count, &data);
  } else {
    std::uint16_t short_count = 0;
    found = TIFFGetField(tiff_, tag, &short_count, &data);
    count = short_count;
  }
  if (found != 1 || data == nullptr) return {};
  if (TIFFFieldDataType(tag_field) != type) {
    throw fault(fmt::format("has TIFF type {} instead of {}",
                            static_cast<int>(TIFFFieldDataType(tag_field)), type))
        .at(fmt::format("field {}", tag))
        .remedy("check that it is a complete GeoTIFF file (gdalinfo)");
  }
  const auto size = static_cast<std::size_t>(TIFFDataWidth(static_cast<TIFFDataType>(type)));
  return {static_cast<const std::byte*>(data), count * size};
}

std::vector<double> GeoTiffHandle::doubles(std::uint32_t tag) const {
  const auto bytes = field(tag, TIFF_DOUBLE);
  std::vector<double> values(bytes.size() / sizeof(double));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

std::vector<std::uint16_t> GeoTiffHandle::shorts(std::uint32_t tag) const {
  const auto bytes = field(tag, TIFF_SHORT);
  std::vector<std::uint16_t> values(bytes.size() / sizeof(std::uint16_t));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

std::string GeoTiffHandle::text(std::uint32_t tag) const {
  const auto bytes = field(tag, TIFF_ASCII);
  std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  while (!text.empty() && text.back() == '\0') text.pop_back();
  return text;
}

}  // namespace terrace::stream
