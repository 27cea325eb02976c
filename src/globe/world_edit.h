// Changes of a world file's text that leave all else as it is, byte for byte: comments, order, line ends.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "globe/world.h"

namespace tellurion::globe {

class Globe;

/// A world file's text and what it says. A change that would not give the world that it should is an error, and nothing has changed.
class WorldText {
 public:
  /// Relative paths are taken from `folder`, errors name `name`. Errors: those of parse_world.
  static Result<WorldText> parse(std::string text, std::filesystem::path folder, std::string name);

  const std::string& text() const { return text_; }
  const World& world() const { return world_; }

  // Errors of all: unsupported (layers in one inline array, which cannot be told apart by lines).

  /// At the end of the file: over the others of its group.
  Result<void> add_layer(const LayerSpec& layer);
  /// With the comment lines right above it.
  Result<void> remove_layer(std::size_t layer);
  Result<void> set_settings(std::size_t layer, const LayerSettings& settings);
  /// Right behind another one, with the comment lines right above it.
  Result<void> move_behind(std::size_t layer, std::size_t other);
  /// Into `files` of a layer of type "catalogue"; those that are in it already are passed over.
  Result<void> add_files(std::size_t layer, const std::vector<std::string>& files);
  /// Out of it. Errors: not_found, naming the first that is not in it; invalid_argument, if nothing would be left.
  Result<void> remove_files(std::size_t layer, const std::vector<std::string>& files);

 private:
  WorldText(std::string text, std::filesystem::path folder, std::string name, World world);
  /// Takes the new text if it says `expected`.
  Result<void> take(std::string text, const World& expected);
  std::pair<std::size_t, std::size_t> lines_of(std::size_t layer) const;

  std::string text_;
  std::filesystem::path folder_;
  std::string name_;
  World world_;
};

/// Reads, changes and writes a world file, whole or not at all, while other processes that do the same wait. A file that is not there
/// is begun with the planet of `begin`. Errors: those of load_world and of `change`; unavailable.
Result<void> edit_world(const std::filesystem::path& file, const World& begin, const std::function<Result<void>(WorldText&)>& change);

/// Keeps the layers as they are now in the world's file, where all else stays as it is: those that were added are put in, those that were
/// removed taken out. A world that is no file of the user's, as the default one or a raster, becomes a new file in `folder`, into which
/// later calls write too. Layers that a program draws itself are left out. Gives the file. Errors: those of edit_world; unsupported (a layer
/// is not in the file any more). Thread-safe; reads and writes files.
Result<std::filesystem::path> save_layers(Globe& globe, const std::filesystem::path& folder);

}  // namespace tellurion::globe
