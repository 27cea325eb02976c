#include "viewer/bindings.h"

#include <GLFW/glfw3.h>

namespace tellurion::apps {
namespace {

constexpr std::array kKeyBindings{
    KeyBinding{Command::zoom_in, '+', 0, true, "+", "zoom in"},
    KeyBinding{Command::zoom_out, '-', 0, true, "-", "zoom out"},
    KeyBinding{Command::north_up, 'n', 0, false, "N", "turn north up"},
    KeyBinding{Command::reset_tilt, 'r', 0, false, "R", "look straight down"},
    KeyBinding{Command::home, 'h', 0, false, "H", "fly home"},
    KeyBinding{Command::clock, ' ', 0, false, "Space", "let the clock run or stand still"},
    KeyBinding{Command::exaggerate_less, '[', 0, true, "[", "less vertical exaggeration"},
    KeyBinding{Command::exaggerate_more, ']', 0, true, "]", "more vertical exaggeration"},
    KeyBinding{Command::lighting, 'l', 0, false, "L", "sun shading on or off"},
    KeyBinding{Command::atmosphere, 'o', 0, false, "O", "atmosphere on or off"},
    KeyBinding{Command::wireframe, 'f', 0, false, "F", "wireframe, coloured by level"},
    KeyBinding{Command::bounds, 'b', 0, false, "B", "the tiles' bounding boxes"},
    KeyBinding{Command::tile_borders, 't', 0, false, "T", "the tiles' borders"},
    KeyBinding{Command::freeze, 'c', 0, false, "C", "keep the tiles of now while the camera moves on"},
    KeyBinding{Command::screenshot, 'p', 0, false, "P", "save the picture as tellurion-NNN.png"},
    KeyBinding{Command::record, 'k', 0, false, "K", "record a flight, or stop"},
    KeyBinding{Command::replay, 'j', 0, false, "J", "replay the flight, or stop"},
    KeyBinding{Command::help, 0, GLFW_KEY_F1, false, "F1", "this help"},
    KeyBinding{Command::statistics, 0, GLFW_KEY_F2, false, "F2", "statistics"},
    KeyBinding{Command::layers, 0, GLFW_KEY_F3, false, "F3", "layers"},
    KeyBinding{Command::settings, 0, GLFW_KEY_F4, false, "F4", "settings"},
    KeyBinding{Command::quit, 0, GLFW_KEY_ESCAPE, false, "Esc", "quit"},
};

constexpr std::array kGestures{
    Gesture{"left drag", "move the ground along with the cursor"},
    Gesture{"wheel", "zoom towards the cursor, 10 % a step"},
    Gesture{"right drag, ctrl + left", "turn and tilt about the place under the cursor"},
    Gesture{"middle drag, shift + left", "look around"},
    Gesture{"double click", "fly to the place"},
    Gesture{"arrows, W A S D", "move, faster when high"},
    Gesture{"Q, E", "down, up"},
    Gesture{"files dropped here", "become layers on top"},
};

}  // namespace

std::span<const KeyBinding> key_bindings() { return kKeyBindings; }
std::span<const Gesture> gestures() { return kGestures; }

}  // namespace tellurion::apps
