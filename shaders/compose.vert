// An image patch in a colour slot: one instance for each cell of the control grid.
layout(location = 0) in vec4 a_lower_points;  // image coordinates of the cell's corners of lowest t: lowest s, highest s
layout(location = 1) in vec4 a_upper_points;  // of highest t

uniform vec4 u_slot_range;  // clip coordinates of the patch's lower and upper corner
uniform ivec2 u_cells;      // columns, rows

flat out vec4 v_lower_points;
flat out vec4 v_upper_points;
out vec2 v_in_cell;

void main() {
  ivec2 cell = ivec2(gl_InstanceID % u_cells.x, gl_InstanceID / u_cells.x);
  ivec2 corner = ivec2(gl_VertexID & 1, gl_VertexID >> 1);
  vec2 place = vec2(cell + corner) / vec2(u_cells);
  gl_Position = vec4(mix(u_slot_range.xy, u_slot_range.zw, place), 0.0, 1.0);
  v_lower_points = a_lower_points;
  v_upper_points = a_upper_points;
  v_in_cell = vec2(corner);
}
