// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "cli/cli.hpp"

namespace terrace::tools {

std::unique_ptr<Command> make_build();
std::unique_ptr<Command> make_cluster();
std::unique_ptr<Command> make_contour();
std::unique_ptr<Command> make_convert();
std::unique_ptr<Command> make_info();
std::unique_ptr<Command> make_match();
std::unique_ptr<Command> make_merge();
std::unique_ptr<Command> make_mesh();
std::unique_ptr<Command> make_points();
std::unique_ptr<Command> make_profile();
std::unique_ptr<Command> make_publish();
std::unique_ptr<Command> make_raster();
std::unique_ptr<Command> make_render();
std::unique_ptr<Command> make_sample();
std::unique_ptr<Command> make_surface();
std::unique_ptr<Command> make_synth();
std::unique_ptr<Command> make_tile();
std::unique_ptr<Command> make_verify();
std::unique_ptr<Command> make_view();

}  // namespace terrace::tools
