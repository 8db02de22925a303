// SPDX-License-Identifier: GPL-3.0-or-later
// info: what a store or a file holds.
#include <filesystem>

#include <CLI/CLI.hpp>
#include <terrace/stream/store.hpp>

#include "terrace/terrain/error.hpp"
#include "verbs/info.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {
namespace {

class InfoCommand : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("input", input_, "Store, or file of points or cells; - is standard input")
        ->required()
        ->type_name("STORE|FILE");
    add_heights_of_colour(app, colours_);
  }

  Summary run(const CommonOptions& common) override {
    const bool ept = std::filesystem::exists(std::filesystem::path(input_) / "ept.json");
    const bool store =
        !ept && (std::filesystem::is_directory(input_) || stream::Store::recover(input_));
    if (store && colours_ != stream::HeightsOfColour::none) {
      throw UsageError("'" + input_ + "' is a store: --rgb does not apply");
    }
    return store ? info_of_store(input_) : info_of_file(input_, colours_, common);
  }

 private:
  std::string input_;
  stream::HeightsOfColour colours_ = stream::HeightsOfColour::none;
};

}  // namespace

std::unique_ptr<Command> make_info() { return std::make_unique<InfoCommand>(); }

}  // namespace terrace::tools
