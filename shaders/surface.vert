// A tile of the surface: exaggeration, morph and skirt, light and air at each vertex.
layout(location = 0) in vec3 a_base;       // see surface::TileVertex
layout(location = 1) in vec3 a_up_offset;
layout(location = 2) in vec2 a_heights;    // own, parent's
layout(location = 3) in vec2 a_st;
layout(location = 4) in float a_skirt;

// 0: origin - eye, upper part; reference height   1: origin - eye, lower part; morph
// 2: normal at the origin; skirt depth            3: tangent of the slope map; level
// 4: colour slot's scale, offset, layer           5: slope slot's likewise
// 6: the slot that it fades from, likewise        7: fade; sink depth, sink level; layer of the effects
// 8: layer of the overlay; layer of the normals
uniform vec4 u_tile[9];

// Few and full: a software rasteriser pays for every one of a triangle.
out vec4 v_uv;            // of the colour slot, of the slope slot
#ifdef LOG_DEPTH
out float v_behind;
#endif
#ifdef FADE
out vec2 v_before_uv;
#endif
#ifdef BORDERS
out vec2 v_st;
#endif
#ifdef LIGHT
// What of the light reaches the eye through the air, and in w the light of the air itself: red, green, blue.
out vec4 v_sun;           // direction to the sun along the slope map's tangents and up
out vec4 v_sunlight;
out vec4 v_ambient;
#ifdef EFFECTS
out vec4 v_eye;           // direction to the eye likewise; share of the night's own light
#endif
#ifdef NORMALS
out vec3 v_up;
#endif
#elif defined(ATMOSPHERE)
out vec3 v_air_light;
out vec3 v_air_through;
#endif

void main() {
  float exaggeration = sun.w;
  vec3 up = u_tile[2].xyz + a_up_offset;
  float height = mix(a_heights.y, a_heights.x, u_tile[1].w);
  vec3 displaced = exaggeration * (u_tile[0].w * a_up_offset + height * up);
  displaced -= clamp(exaggeration * (u_tile[0].w + height) - u_tile[7].z, 0.0, u_tile[7].y) * up;
  float behind = 0.0;  // metres, see surface::TileVertex
  if (a_skirt != 0.0) {
    behind = u_tile[2].w;
    vec3 outward = a_base - up * dot(a_base, up);
    // Outward just enough to be seen from above; slopes grow with exaggeration, and what a step aside changes with them.
    float lean = 0.05 / max(exaggeration, 1.0);
    displaced -= behind * max(a_skirt, 0.0) * (up - lean * normalize(outward));
  }
  // Near the eye the first sum is exact, so a moving eye does not make vertices jitter.
  vec3 relative = (a_base + u_tile[0].xyz) + u_tile[1].xyz + displaced;
  gl_Position = clip_from_relative * vec4(relative, 1.0);
#ifdef LOG_DEPTH
  v_behind = behind;
#else
  if (behind > 0.0 && gl_Position.w > 0.0) gl_Position.z *= gl_Position.w / (gl_Position.w + behind);
#endif

#if defined(WIREFRAME) && !defined(LOG_DEPTH)
  gl_Position.z *= 1.002;  // a little nearer than the surface
#endif
  v_uv = vec4(a_st * u_tile[4].x + u_tile[4].yz, a_st * u_tile[5].x + u_tile[5].yz);
#ifdef FADE
  v_before_uv = a_st * u_tile[6].x + u_tile[6].yz;
#endif
#ifdef BORDERS
  v_st = a_st;
#endif

  vec3 air_light = vec3(0.0);
  vec3 air_through = vec3(1.0);
#ifdef ATMOSPHERE
  vec3 from_eye = relative * air_scale.xyz;
  float distance_in_air = length(from_eye);
  vec3 direction = from_eye / max(distance_in_air, 1e-12);
  vec3 place = air_eye.xyz + from_eye;
  float enters = min(within_atmosphere(direction).x, distance_in_air);
  scatter(direction, enters, distance_in_air, enters > 0.0 ? -0.9 : -0.3, 5, air_light, air_through);
#endif

#ifdef LIGHT
  vec3 tangent_u = normalize(u_tile[3].xyz - up * dot(u_tile[3].xyz, up));
  vec3 tangent_v = cross(tangent_u, up);
  vec3 to_sun = vec3(dot(sun.xyz, tangent_u), dot(sun.xyz, tangent_v), dot(sun.xyz, up));
  // The sun's disc sinks behind the horizon, and twilight follows it.
  float day = smoothstep(-0.03, 0.05, to_sun.z);
  float sky = smoothstep(-0.18, 0.25, to_sun.z);
  vec3 sunlight = vec3(0.85 * day);
  vec3 ambient = vec3(mix(0.025, 0.25, sky));
#ifdef ATMOSPHERE
  // Relative to a high sun, under which pictures of the ground were taken.
  vec3 colour = sunlight_at(place) * exp(air_extinction.rgb * air_scale.w);
  sunlight *= min(colour, vec3(1.0));
  ambient *= mix(vec3(0.85, 0.95, 1.2), vec3(1.0), sky);
#endif
  v_sun = vec4(to_sun, air_light.r);
  v_sunlight = vec4(sunlight * air_through, air_light.g);
  v_ambient = vec4(ambient * air_through, air_light.b);
#ifdef NORMALS
  v_up = up;
#endif
#ifdef EFFECTS
  float night = 1.0 - smoothstep(-0.2, 0.02, to_sun.z);
  v_eye = vec4(-dot(relative, tangent_u), -dot(relative, tangent_v), -dot(relative, up), night * air_through.g);
#endif
#elif defined(ATMOSPHERE)
  v_air_light = air_light;
  v_air_through = air_through;
#endif
}
