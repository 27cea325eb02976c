// Places are bilinear between the control points, exact at every texel; colours are premultiplied and encoded.
layout(location = 0) out vec4 o_colour;

uniform sampler2D u_image;
uniform sampler2D u_below;    // the slot as it was before
uniform vec4 u_image_texels;  // xy: size of the image in texels; zw: of the texture that holds it
uniform vec4 u_extent;        // texels of the image between which there are data
uniform vec2 u_pixel;         // of the raster, in texels of the image
uniform vec2 u_feather;       // texels of the image over which it fades inwards from there; 0: it ends on its border
uniform vec3 u_adjust;        // opacity, gamma, multiplier

flat in vec4 v_lower_points;
flat in vec4 v_upper_points;
in vec2 v_in_cell;

vec4 image_at(vec2 texel) { return texture(u_image, clamp(texel, vec2(0.5), u_image_texels.xy - 0.5) / u_image_texels.zw); }

void main() {
  vec2 lower = mix(v_lower_points.xy, v_lower_points.zw, v_in_cell.x);
  vec2 upper = mix(v_upper_points.xy, v_upper_points.zw, v_in_cell.x);
  vec2 texel = mix(lower, upper, v_in_cell.y) * u_image_texels.xy;
  vec2 along_x = dFdx(texel), along_y = dFdy(texel);
  vec2 slot_texel = sqrt(along_x * along_x + along_y * along_y);
  bool is_soft = u_feather.x > 0.0;
  vec2 beyond = max(u_extent.xy - texel, texel - u_extent.zw) / max(max(slot_texel, is_soft ? u_feather : u_pixel), 1e-6);
  float there = (is_soft ? 0.0 : 1.0) - max(beyond.x, beyond.y);
  there = clamp(there, 0.0, 1.0);
  // Where the slot's texel is larger than the image's, up to twice, the mean under it: of four places, as far apart as is needed.
  float aside = 0.5 - 0.5 / max(max(slot_texel.x, slot_texel.y), 1.0);
  vec2 x = aside * along_x, y = aside * along_y;
  vec4 colour = aside > 0.0 ? 0.25 * (image_at(texel - x - y) + image_at(texel + x - y) + image_at(texel - x + y) + image_at(texel + x + y)) : image_at(texel);
  colour *= there;
#ifdef ADJUST
  vec3 plain = colour.rgb / max(colour.a, 1.0 / 255.0);
  colour.rgb = clamp(pow(plain, vec3(u_adjust.y)) * u_adjust.z, 0.0, 1.0) * colour.a;
#endif
#ifdef MASK
  if (is_soft) {
    if (colour.a <= 0.0) discard;
    o_colour = vec4(mix(texelFetch(u_below, ivec2(gl_FragCoord.xy), 0).a, colour.r / colour.a, colour.a * u_adjust.x));
    return;
  }
  if (colour.a < 0.5) discard;
  o_colour = vec4(colour.r / colour.a);
#elif defined(GRAYSCALE)
  // The image's brightness as the V of HSV: hue and saturation stay if red, green and blue keep their ratios. Where nothing
  // lies below, or black, there is no hue.
  vec4 below = texelFetch(u_below, ivec2(gl_FragCoord.xy), 0);
  float grey = colour.r / max(colour.a, 1.0 / 255.0);
  float value = max(max(below.r, below.g), below.b);
  vec3 tinted = value > 0.0 ? below.rgb * (grey / value) : vec3(grey);
  o_colour = vec4(mix(vec3(grey), tinted, below.a), 1.0) * (colour.a * u_adjust.x);
#else
  o_colour = colour * u_adjust.x;
#endif
}
