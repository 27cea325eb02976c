// The sky as a mesh of rings round the eye, denser towards the horizon; its colour is computed at the vertices.
// Vertex (ring, sector) has the number ring * (SECTORS + 1) + sector.
const int kSectors = 192;
const int kRings = 24;

out vec3 v_colour;

void main() {
  int sector = gl_VertexID % (kSectors + 1);
  float t = float(gl_VertexID / (kSectors + 1)) / float(kRings);
  float azimuth = 2.0 * kPi * float(sector % kSectors) / float(kSectors);
  float angle = mix(sky_east.w, sky_north.w, t * t);
  vec3 direction = cos(angle) * (cos(azimuth) * sky_east.xyz + sin(azimuth) * sky_north.xyz) + sin(angle) * sky_up.xyz;

  gl_Position = clip_from_relative * vec4(direction / air_scale.xyz * air_scale.x, 0.0);

  vec2 range = within_atmosphere(direction);
  vec3 light = vec3(0.0);
  vec3 through = vec3(1.0);
  if (range.y > range.x) scatter(direction, range.x, range.y, range.x > 0.0 ? 0.0 : 0.9, 12, light, through);
  v_colour = sqrt(light + clear_colour.rgb * clear_colour.rgb * through);
}
