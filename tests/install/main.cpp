// Compiles and links against the installed package; the examples do the rest.
#include <glm/vec3.hpp>  // comes with tellurion::globe

int main() { return glm::dvec3(0.0).x == 0.0 ? 0 : 1; }
