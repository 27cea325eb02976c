// The surface's colour: one fetch from the composed slot (two while it fades), shading by the slopes of the elevation.
#ifdef MEASURE
layout(location = 0) out uint o_nearness;
#else
layout(location = 0) out vec4 o_colour;
#endif

uniform sampler2DArray u_colour;
uniform sampler2DArray u_slope;
uniform sampler2DArray u_before;
uniform sampler2DArray u_effects;
uniform sampler2DArray u_overlay;
uniform sampler2DArray u_normals;
uniform vec4 u_tile[9];

in vec4 v_uv;
#ifdef LOG_DEPTH
in float v_behind;
#endif
#ifdef FADE
in vec2 v_before_uv;
#endif
#ifdef BORDERS
in vec2 v_st;
#endif
#ifdef LIGHT
in vec4 v_sun;
in vec4 v_sunlight;
in vec4 v_ambient;
#ifdef EFFECTS
in vec4 v_eye;
#endif
#ifdef NORMALS
in vec3 v_up;
#endif
#elif defined(ATMOSPHERE)
in vec3 v_air_light;
in vec3 v_air_through;
#endif

// Levels of detail: a slot's texels measure half a pixel to one, and the levels that the hardware would mix for that blur. Pictures come
// nearest to the means of 16 samples a pixel with this one (-0.5 and -1.5 are both further away): docs/decisions/0008-sharpness.md.
const float kSharpness = -1.0;

// Ground that no image covers, encoded.
const vec3 kBareGround = vec3(0.66, 0.64, 0.60);

// A colour of its own for each level.
vec3 level_colour(float level) {
  float hue = fract(level * 0.381966 + 0.55);
  return clamp(abs(fract(hue + vec3(0.0, 2.0 / 3.0, 1.0 / 3.0)) * 6.0 - 3.0) - 1.0, 0.0, 1.0) * 0.85 + 0.15;
}

#ifdef NORMALS
// Along the slope map's tangents, of a normal in the frame of east, north and up; see surface::ImageUse.
vec2 slope_of_normal(vec3 encoded) {
  vec3 normal = 2.0 * encoded - 1.0;
  vec2 rise = -normal.xy / max(normal.z, 0.02);  // to the east, to the north
  vec3 up = normalize(v_up);
  vec3 east = vec3(-up.y, up.x, 0.0) * inversesqrt(max(dot(up.xy, up.xy), 1e-12));
  vec3 along = rise.x * east + rise.y * cross(up, east);
  vec3 tangent_u = normalize(u_tile[3].xyz - up * dot(u_tile[3].xyz, up));
  return vec2(dot(along, tangent_u), dot(along, cross(tangent_u, up)));
}
#endif

void main() {
#ifdef LOG_DEPTH
  gl_FragDepth = log2(1.0 + 1.0 / gl_FragCoord.w + v_behind) / 40.0;
#ifdef WIREFRAME
  gl_FragDepth -= 7e-5;  // nearer by 0.002 of the distance
#endif
#endif

#if defined(MEASURE)
  o_nearness = floatBitsToUint(gl_FragCoord.w);  // 1 / distance along the view's axis
#elif defined(WIREFRAME)
  o_colour = vec4(level_colour(u_tile[3].w), 1.0);
#else
  vec4 texel = texture(u_colour, vec3(v_uv.xy, u_tile[4].w), kSharpness);
#ifdef FADE
  texel = mix(texture(u_before, vec3(v_before_uv, u_tile[6].w), kSharpness), texel, u_tile[7].x);
#endif
  vec3 colour = texel.rgb + (1.0 - texel.a) * kBareGround;

#if defined(LIGHT) || defined(ATMOSPHERE)
  colour *= colour;  // sRGB's curve, nearly
#ifdef LIGHT
  vec2 slope = sun.w * texture(u_slope, vec3(v_uv.zw, u_tile[5].w)).rg;
#ifdef NORMALS
  vec4 normals = texture(u_normals, vec3(v_uv.xy, u_tile[8].y), kSharpness);
  slope = mix(slope, sun.w * slope_of_normal(normals.rgb / max(normals.a, 1.0 / 255.0)), normals.a);
#endif
  float facing = (v_sun.z - dot(slope, v_sun.xy)) * inversesqrt(1.0 + dot(slope, slope));
  colour *= v_ambient.rgb + v_sunlight.rgb * max(facing, 0.0);
#ifdef EFFECTS
  vec4 effects = texture(u_effects, vec3(v_uv.xy, u_tile[7].w), kSharpness);
  colour += v_eye.w * effects.rgb * effects.rgb;
  // The sun mirrored by waves: slopes as Cox and Munk (1954, doi:10.1364/JOSA.44.000838) measured under a wind of 5 m/s, variance
  // 0.0286, and Schlick's approximation of what water reflects. The half-way vector to a unit sun and eye has the length
  // 2 cos(angle of incidence).
  vec3 half_way = v_sun.xyz + v_eye.xyz * inversesqrt(dot(v_eye.xyz, v_eye.xyz));
  float squared = dot(half_way, half_way);
  float slope_squared = squared / max(half_way.z * half_way.z, 1e-6) - 1.0;
  float grazing = 1.0 - 0.5 * sqrt(squared), twice = grazing * grazing;
  float mirrored = (0.02 + 0.98 * twice * twice * grazing) / (4.0 * 0.0286) * exp2(-slope_squared / (0.0286 * 0.6931));
  colour += effects.a * mirrored * v_sunlight.rgb;
#endif
  colour += vec3(v_sun.w, v_sunlight.w, v_ambient.w);
#else
  colour = colour * v_air_through + v_air_light;
#endif
  colour = sqrt(colour);
#endif

#ifdef OVERLAY
  vec4 overlay = texture(u_overlay, vec3(v_uv.xy, u_tile[8].x), kSharpness);
  colour = overlay.rgb + (1.0 - overlay.a) * colour;
#endif
#ifdef BORDERS
  vec2 inside = min(v_st, 1.0 - v_st) / fwidth(v_st);  // pixels
  float line = clamp(1.5 - min(inside.x, inside.y), 0.0, 1.0);
  colour = mix(colour, level_colour(u_tile[3].w), line);
#endif
  o_colour = vec4(colour, 1.0);
#endif
}
