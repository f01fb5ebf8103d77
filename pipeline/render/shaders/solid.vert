#version 330
// A corner in the eye's axes; `nearer` (m) draws it as if it lay that much nearer to the eye.
in vec3 place;
in vec3 normal;
in vec3 colour;
uniform mat4 view;
uniform mat4 projection;
uniform float nearer;
out vec3 at;
out vec3 facing;
out vec3 albedo;
void main() {
  vec4 seen = view * vec4(place, 1.0);
  at = seen.xyz;
  facing = mat3(view) * normal;
  albedo = colour;
  gl_Position = projection * seen;
  vec4 moved = projection * vec4(seen.xyz * (1.0 - nearer / max(length(seen.xyz), 1e-6)), 1.0);
  gl_Position.z = moved.z / moved.w * gl_Position.w;
}
