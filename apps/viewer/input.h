// What the user does at the window, as events in the order in which they happened. Positions are pixels of the picture.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <variant>
#include <vector>

#include "viewer/bindings.h"

struct GLFWwindow;

namespace tellurion::apps {

class Window;

enum class Drag { pan, orbit, look };

struct DragStart {
  Drag drag;
  glm::dvec2 at;
};
struct CursorMove {
  glm::dvec2 at;
};
struct DragEnd {
  glm::dvec2 at;
};
struct Wheel {
  double steps;  ///< positive: away from the user
  glm::dvec2 at;
};
struct DoubleClick {
  glm::dvec2 at;
};
/// Files and folders that were dropped on the window.
struct Drop {
  std::vector<std::string> paths;
};
using Event = std::variant<DragStart, CursorMove, DragEnd, Wheel, DoubleClick, Drop, Command>;

class Input {
 public:
  /// Listens to `window`, which outlives this. Made before Dear ImGui's back-end, which passes events on to us.
  explicit Input(const Window& window);
  ~Input();
  Input(const Input&) = delete;
  Input& operator=(const Input&) = delete;

  /// Lets the desktop report what has happened; waits up to `seconds` for the first report.
  void wait(double seconds);

  /// Takes the events since the last call. `mouse_taken`, `keyboard_taken`: a panel has the mouse or the keyboard, so
  /// that nothing starts here; what has started goes on.
  std::vector<Event> take_events(bool mouse_taken, bool keyboard_taken);

  /// Whether anything came from the desktop since the last call, be it only that the window must be drawn again.
  bool take_activity();

  /// The motion that held keys ask for: right, forward, up, each -1, 0 or 1.
  glm::dvec3 held_motion(bool keyboard_taken) const;

  glm::dvec2 cursor() const;
  bool cursor_inside() const;

 private:
  struct Press {
    int button;
    int modifiers;
    glm::dvec2 at;
    double time;
  };
  struct Release {
    int button;
    glm::dvec2 at;
  };
  using Report = std::variant<Press, Release, CursorMove, Wheel, Drop, Command>;

  static Input& of(GLFWwindow* window);
  void on_key(int key, int action);
  void on_character(unsigned character);
  void press(const Press& press, std::vector<Event>& events);

  const Window& window_;
  std::vector<Report> reports_;
  bool activity_ = true;
  bool key_repeats_ = false;
  int drag_button_ = -1;
  double waited_until_ = 0;
  bool reports_are_late_ = false;  ///< they happened while a frame was drawn
  double last_press_time_ = -1e9;
  glm::dvec2 last_press_at_{0.0};
};

}  // namespace tellurion::apps
