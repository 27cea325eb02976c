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
uniform vec4 u_tile[8];

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
#elif defined(ATMOSPHERE)
in vec3 v_air_light;
in vec3 v_air_through;
#endif

// Ground that no image covers, encoded.
const vec3 kBareGround = vec3(0.66, 0.64, 0.60);

// A colour of its own for each level.
vec3 level_colour(float level) {
  float hue = fract(level * 0.381966 + 0.55);
  return clamp(abs(fract(hue + vec3(0.0, 2.0 / 3.0, 1.0 / 3.0)) * 6.0 - 3.0) - 1.0, 0.0, 1.0) * 0.85 + 0.15;
}

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
  vec4 texel = texture(u_colour, vec3(v_uv.xy, u_tile[4].w));
#ifdef FADE
  texel = mix(texture(u_before, vec3(v_before_uv, u_tile[6].w)), texel, u_tile[7].x);
#endif
  vec3 colour = texel.rgb + (1.0 - texel.a) * kBareGround;

#if defined(LIGHT) || defined(ATMOSPHERE)
  colour *= colour;  // sRGB's curve, nearly
#ifdef LIGHT
  vec2 slope = sun.w * texture(u_slope, vec3(v_uv.zw, u_tile[5].w)).rg;
  float facing = (v_sun.z - dot(slope, v_sun.xy)) * inversesqrt(1.0 + dot(slope, slope));
  colour *= v_ambient.rgb + v_sunlight.rgb * max(facing, 0.0);
#ifdef EFFECTS
  vec4 effects = texture(u_effects, vec3(v_uv.xy, u_tile[7].w));
  colour += v_eye.w * effects.rgb * effects.rgb;
  // The sun's mirror image in water under a moderate wind, spread by its waves: Blinn's lobe as wide as their slopes
  // (variance 0.02), weakened by Schlick's approximation of Fresnel's share for water.
  vec3 to_eye = normalize(v_eye.xyz);
  vec3 half_way = normalize(normalize(v_sun.xyz) + to_eye);
  float mirrored = 0.02 + 0.98 * pow(1.0 - clamp(dot(half_way, to_eye), 0.0, 1.0), 5.0);
  colour += effects.a * mirrored * 12.5 * pow(max(half_way.z, 0.0), 100.0) * v_sunlight.rgb * max(v_sun.z, 0.0);
#endif
  colour += vec3(v_sun.w, v_sunlight.w, v_ambient.w);
#else
  colour = colour * v_air_through + v_air_light;
#endif
  colour = sqrt(colour);
#endif

#ifdef BORDERS
  vec2 inside = min(v_st, 1.0 - v_st) / fwidth(v_st);  // pixels
  float line = clamp(1.5 - min(inside.x, inside.y), 0.0, 1.0);
  colour = mix(colour, level_colour(u_tile[3].w), line);
#endif
  o_colour = vec4(colour, 1.0);
#endif
}
