// Single scattering of sunlight in an exponential atmosphere round a sphere.
// Positions are in the atmosphere's space: the ellipsoid stretched to the unit sphere.
// Optical depth to space: the Chapman function's approximation of C. Schueler, "An Approximation to the Chapman
// Grazing-Incidence Function for Atmospheric Scattering", GPU Pro 3 (2012). Along the view ray: a sum over a few samples.

const float kPi = 3.14159265;

// Optical depth from `p` to space in direction `d`, for a density of 1 at the ground.
float depth_to_space(vec3 p, vec3 d) {
  float r = length(p);
  float mu = dot(p, d) / r;
  float x = r / air_scale.w;
  float c = sqrt(0.5 * kPi * x);
  float density = exp((1.0 - r) / air_scale.w);
  float up = c / ((c - 1.0) * abs(mu) + 1.0);
  if (mu >= 0.0) return density * up * air_scale.w;
  float lowest = max(sqrt(max(1.0 - mu * mu, 0.0)) * x, 1.0);  // the ray's closest point to the centre
  float through = 2.0 * sqrt(0.5 * kPi * lowest) * exp(min((1.0 / air_scale.w) - lowest, 40.0));
  return (through - density * up) * air_scale.w;
}

// Share of the sun's light that reaches `p`.
vec3 sunlight_at(vec3 p) {
  return exp(-air_extinction.rgb * depth_to_space(p, air_sun.xyz));
}

// Where the ray from the eye enters (x) and leaves (y) the atmosphere's top; y < x if it misses.
vec2 within_atmosphere(vec3 direction) {
  float b = dot(air_eye.xyz, direction);
  float c = dot(air_eye.xyz, air_eye.xyz) - sky_up.w * sky_up.w;
  float root = b * b - c;
  if (root < 0.0) return vec2(1.0, 0.0);
  root = sqrt(root);
  return vec2(max(-b - root, 0.0), -b + root);
}

// Light that the air between two distances along a ray from the eye sends to it, tone-mapped and linear, and the share
// of light that passes. `bias`: how strongly the samples gather at the near (> 0) or the far end (< 0), in [-1, 1].
void scatter(vec3 direction, float from, float to, float bias, int samples, out vec3 light, out vec3 through) {
  vec3 depth = vec3(0.0);
  light = vec3(0.0);
  float count = float(samples);
  for (int i = 0; i < samples; ++i) {
    float t = (float(i) + 0.5) / count;
    float s = t + bias * (t * t - t);
    float width = (1.0 + bias * (2.0 * t - 1.0)) / count * (to - from);
    vec3 p = air_eye.xyz + direction * (from + s * (to - from));
    float air = exp(min((1.0 - length(p)) / air_scale.w, 0.0)) * width;
    vec3 here = air_extinction.rgb * air;
    light += exp(-(depth + 0.5 * here)) * sunlight_at(p) * air;
    depth += here;
  }
  through = exp(-depth);
  float mu = dot(direction, air_sun.xyz);
  float molecules = 3.0 / (16.0 * kPi) * (1.0 + mu * mu);
  const float g = 0.76;
  float haze = (1.0 - g * g) / (4.0 * kPi * pow(1.0 + g * g - 2.0 * g * mu, 1.5));
  light *= air_sun.w * (air_scatter.rgb * molecules + air_scatter.w * haze);
  light = 1.0 - exp(-light);
}
