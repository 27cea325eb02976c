// The height of the ground under a moving eye, without waiting for it.
#pragma once

#include <memory>
#include <optional>

#include "globe/globe.h"
#include "view/camera.h"

namespace tellurion::globe {

class GroundBelow {
 public:
  GroundBelow();

  /// As a worker of `globe` found it last, before that as its resident heights have it; nothing before either. Asks for the next one.
  std::optional<EllipsoidalHeight> find(Globe& globe, const view::Camera& camera);

 private:
  struct Answer;
  std::shared_ptr<Answer> answer_;
};

}  // namespace tellurion::globe
