// What is the same for all that a frame draws. Filled by src/render/frame_block.cpp; the layouts must agree.
layout(std140) uniform Frame {
  mat4 clip_from_relative;  // metres from the eye in Ecef axes -> clip space
  vec4 sun;                 // xyz: unit direction to the sun; w: exaggeration of heights
  vec4 air_sun;             // xyz: the sun's direction for the atmosphere (in its space); w: brightness
  vec4 air_eye;             // xyz: the eye in the atmosphere's space
  vec4 air_scale;           // xyz: metres in Ecef axes -> the atmosphere's space; w: scale height there
  vec4 air_scatter;         // rgb: scattering by molecules per unit of length at the ground; w: by haze
  vec4 air_extinction;      // rgb: loss of light per unit of length at the ground
  vec4 sky_east;            // xyz: directions at the eye in the atmosphere's space; w: lowest angle of the sky mesh
  vec4 sky_north;           // w: highest angle
  vec4 sky_up;              // w: radius of the atmosphere's top
  vec4 clear_colour;        // rgb encoded
};
