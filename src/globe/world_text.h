// Parts of a world file as text.
#pragma once

#include <filesystem>
#include <string>

#include "globe/world.h"

namespace tellurion::globe {

/// A layer as [[layer]], with paths as a world file in `folder` names them.
std::string to_toml(const LayerSpec& layer, const std::filesystem::path& folder);

/// A number, always with a point or exponent.
std::string to_toml(double value);

/// A string between double quotes.
std::string to_toml(const std::string& text);

/// The table [planet].
std::string planet_to_toml(const World& world);

/// A path, or URL, as a world file in `folder` names it: relative if it lies below.
std::string name_in(const std::string& path, const std::filesystem::path& folder);

/// A world file's text. Errors: not_found, unsupported (too large), unavailable.
Result<std::string> read_whole(const std::filesystem::path& file);

/// Writes `text` to `file`, whole or not at all, with the rights that the file has. Errors: unavailable.
Result<void> write_whole(const std::filesystem::path& file, const std::string& text);

}  // namespace tellurion::globe
