layout(location = 0) out vec4 o_colour;

void main() {
#ifdef LOG_DEPTH
  gl_FragDepth = log2(1.0 + 1.0 / gl_FragCoord.w) / 40.0;
#endif
  o_colour = vec4(1.0, 0.85, 0.2, 1.0);
}
