// Edges of a tile's bounding box. Vertex i is corner i: its bits say which end of each axis.
uniform vec4 u_box[4];  // 0: lowest corner from the eye  1 to 3: edges

void main() {
  vec3 end = vec3(gl_VertexID & 1, (gl_VertexID >> 1) & 1, gl_VertexID >> 2);
  gl_Position = clip_from_relative * vec4(u_box[0].xyz + end.x * u_box[1].xyz + end.y * u_box[2].xyz + end.z * u_box[3].xyz, 1.0);
}
