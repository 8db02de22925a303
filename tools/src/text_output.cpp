// SPDX-License-Identifier: GPL-3.0-or-later
#include "text_output.hpp"

#include <cerrno>
#include <cstdio>

#include "terrace/stream/error.hpp"

namespace terrace::tools {

TextOutput::TextOutput(const std::string& path, bool replace) {
  if (path != "-") file_.emplace(path, replace);
}

void TextOutput::write(std::string_view text) {
  if (file_) return file_->write(text);
  if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size()) return;
  throw stream::system_error("standard output", "cannot write", errno);
}

void TextOutput::finish() {
  if (file_) return file_->commit();
  if (std::fflush(stdout) != 0)
    throw stream::system_error("standard output", "cannot write", errno);
}

}  // namespace terrace::tools
