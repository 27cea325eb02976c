#include "viewer/input.h"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <cctype>
#include <glm/geometric.hpp>
#include <optional>
#include <utility>

#include "viewer/window.h"

namespace tellurion::apps {
namespace {

constexpr double kDoubleClickSeconds = 0.4;
constexpr double kDoubleClickPixels = 6.0;

glm::dvec2 cursor_of(const Window& window) {
  glm::dvec2 at(0.0);
  glfwGetCursorPos(window.handle(), &at.x, &at.y);
  return at * window.scale();
}

std::optional<Drag> drag_of(int button, int modifiers) {
  switch (button) {
    case GLFW_MOUSE_BUTTON_LEFT:
      if (modifiers & GLFW_MOD_CONTROL) return Drag::orbit;
      return modifiers & GLFW_MOD_SHIFT ? Drag::look : Drag::pan;
    case GLFW_MOUSE_BUTTON_RIGHT:
      return Drag::orbit;
    case GLFW_MOUSE_BUTTON_MIDDLE:
      return Drag::look;
    default:
      return std::nullopt;
  }
}

}  // namespace

Input& Input::of(GLFWwindow* window) {
  auto& input = *static_cast<Input*>(glfwGetWindowUserPointer(window));
  input.activity_ = true;
  return input;
}

Input::Input(const Window& window) : window_(window) {
  GLFWwindow* handle = window.handle();
  glfwSetWindowUserPointer(handle, this);
  glfwSetMouseButtonCallback(handle, [](GLFWwindow* w, int button, int action, int modifiers) {
    Input& self = of(w);
    const glm::dvec2 at = self.cursor();
    // GLFW tells no times. Counted from the frame's beginning, slow frames do not tear double clicks apart.
    const double time = self.reports_are_late_ ? self.waited_until_ : glfwGetTime();
    if (action == GLFW_PRESS)
      self.reports_.emplace_back(Press{button, modifiers, at, time});
    else
      self.reports_.emplace_back(Release{button, at});
  });
  glfwSetCursorPosCallback(handle, [](GLFWwindow* w, double x, double y) {
    Input& self = of(w);
    const CursorMove move{glm::dvec2(x, y) * self.window_.scale()};
    // Of moves in a row only the last one counts.
    if (!self.reports_.empty() && std::holds_alternative<CursorMove>(self.reports_.back()))
      self.reports_.back() = move;
    else
      self.reports_.emplace_back(move);
  });
  glfwSetScrollCallback(handle, [](GLFWwindow* w, double, double steps) {
    Input& self = of(w);
    self.reports_.emplace_back(Wheel{steps, self.cursor()});
  });
  glfwSetDropCallback(handle, [](GLFWwindow* w, int count, const char** paths) { of(w).reports_.emplace_back(Drop{{paths, paths + count}}); });
  glfwSetKeyCallback(handle, [](GLFWwindow* w, int key, int, int action, int) { of(w).on_key(key, action); });
  glfwSetCharCallback(handle, [](GLFWwindow* w, unsigned character) { of(w).on_character(character); });
  glfwSetCursorEnterCallback(handle, [](GLFWwindow* w, int) { of(w); });
  glfwSetWindowFocusCallback(handle, [](GLFWwindow* w, int) { of(w); });
  glfwSetWindowRefreshCallback(handle, [](GLFWwindow* w) { of(w); });
  glfwSetFramebufferSizeCallback(handle, [](GLFWwindow* w, int, int) { of(w); });
}

Input::~Input() {
  GLFWwindow* handle = window_.handle();
  glfwSetMouseButtonCallback(handle, nullptr);
  glfwSetCursorPosCallback(handle, nullptr);
  glfwSetScrollCallback(handle, nullptr);
  glfwSetDropCallback(handle, nullptr);
  glfwSetKeyCallback(handle, nullptr);
  glfwSetCharCallback(handle, nullptr);
  glfwSetCursorEnterCallback(handle, nullptr);
  glfwSetWindowFocusCallback(handle, nullptr);
  glfwSetWindowRefreshCallback(handle, nullptr);
  glfwSetFramebufferSizeCallback(handle, nullptr);
}

void Input::on_key(int key, int action) {
  key_repeats_ = action == GLFW_REPEAT;
  if (action == GLFW_RELEASE) return;
  for (const KeyBinding& binding : key_bindings()) {
    if (binding.key == key && binding.character == 0 && (!key_repeats_ || binding.repeats))
      reports_.emplace_back(binding.command);
  }
}

void Input::on_character(unsigned character) {
  if (character > 127) return;
  const char lower = static_cast<char>(std::tolower(static_cast<int>(character)));
  for (const KeyBinding& binding : key_bindings()) {
    if (binding.character != 0 && binding.character == lower && (!key_repeats_ || binding.repeats))
      reports_.emplace_back(binding.command);
  }
}

void Input::press(const Press& press, std::vector<Event>& events) {
  if (drag_button_ >= 0) return;
  const auto drag = drag_of(press.button, press.modifiers);
  if (!drag) return;
  const bool again = press.time - last_press_time_ < kDoubleClickSeconds &&
                     glm::distance(press.at, last_press_at_) < kDoubleClickPixels;
  last_press_time_ = again || drag != Drag::pan ? -1e9 : press.time;
  last_press_at_ = press.at;
  if (again && drag == Drag::pan) {
    events.emplace_back(DoubleClick{press.at});
    return;
  }
  drag_button_ = press.button;
  events.emplace_back(DragStart{*drag, press.at});
}

void Input::wait(double seconds) {
  const std::size_t known = reports_.size();
  reports_are_late_ = true;
  glfwPollEvents();
  reports_are_late_ = false;
  if (seconds > 0.0 && !activity_ && reports_.size() == known) glfwWaitEventsTimeout(seconds);
  waited_until_ = glfwGetTime();
}

std::vector<Event> Input::take_events(bool mouse_taken, bool keyboard_taken) {
  std::vector<Event> events;
  for (const Report& report : reports_) {
    if (const auto* p = std::get_if<Press>(&report)) {
      if (!mouse_taken) press(*p, events);
    } else if (const auto* release = std::get_if<Release>(&report)) {
      if (release->button != drag_button_) continue;
      drag_button_ = -1;
      events.emplace_back(DragEnd{release->at});
    } else if (const auto* move = std::get_if<CursorMove>(&report)) {
      events.emplace_back(*move);
    } else if (const auto* wheel = std::get_if<Wheel>(&report)) {
      if (!mouse_taken) events.emplace_back(*wheel);
    } else if (const auto* drop = std::get_if<Drop>(&report)) {
      events.emplace_back(*drop);
    } else if (!keyboard_taken) {
      events.emplace_back(std::get<Command>(report));
    }
  }
  reports_.clear();
  return events;
}

bool Input::take_activity() { return std::exchange(activity_, false); }

glm::dvec3 Input::held_motion(bool keyboard_taken) const {
  if (keyboard_taken) return glm::dvec3(0.0);
  const auto held = [this](std::initializer_list<int> keys) {
    return std::any_of(keys.begin(), keys.end(),
                       [this](int key) { return glfwGetKey(window_.handle(), key) == GLFW_PRESS; })
               ? 1.0
               : 0.0;
  };
  return {held({GLFW_KEY_RIGHT, GLFW_KEY_D}) - held({GLFW_KEY_LEFT, GLFW_KEY_A}),
          held({GLFW_KEY_UP, GLFW_KEY_W}) - held({GLFW_KEY_DOWN, GLFW_KEY_S}),
          held({GLFW_KEY_E, GLFW_KEY_PAGE_UP}) - held({GLFW_KEY_Q, GLFW_KEY_PAGE_DOWN})};
}

glm::dvec2 Input::cursor() const { return cursor_of(window_); }

bool Input::cursor_inside() const { return glfwGetWindowAttrib(window_.handle(), GLFW_HOVERED) != 0; }

}  // namespace tellurion::apps
