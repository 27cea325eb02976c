// A slot's next smaller level: means of four texels, rounded to the nearest (filtering in hardware may round up, by
// half a step at each level).
layout(location = 0) out vec4 o_colour;

uniform sampler2DArray u_slots;  // its base level is the larger level
uniform int u_layer;

void main() {
  ivec3 p = ivec3(2 * ivec2(gl_FragCoord.xy), u_layer);
  o_colour = 0.25 * (texelFetch(u_slots, p, 0) + texelFetch(u_slots, p + ivec3(1, 0, 0), 0) +
                     texelFetch(u_slots, p + ivec3(0, 1, 0), 0) + texelFetch(u_slots, p + ivec3(1, 1, 0), 0));
}
