// What each key and each mouse gesture does: the table behind the keyboard, the help panel and docs/viewer.md.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace tellurion::apps {

enum class Command : std::uint8_t {
  zoom_in,
  zoom_out,
  north_up,
  reset_tilt,
  home,
  freeze,
  help,
  statistics,
  layers,
  settings,
  save_layers,
  wireframe,
  bounds,
  tile_borders,
  lighting,
  atmosphere,
  exaggerate_less,
  exaggerate_more,
  clock,
  screenshot,
  record,
  replay,
  quit,
};

/// A key that gives a command: by the character that it types, so that every keyboard layout works, or by its GLFW
/// number.
struct KeyBinding {
  Command command;
  char character;  ///< lower case; 0: by `key`
  int key;         ///< GLFW's number; 0: by `character`
  bool repeats;    ///< while held
  const char* label;
  const char* effect;
};

/// What is done by holding keys or by the mouse.
struct Gesture {
  const char* label;
  const char* effect;
};

std::span<const KeyBinding> key_bindings();
std::span<const Gesture> gestures();

}  // namespace tellurion::apps
