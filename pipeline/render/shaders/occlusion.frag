#version 330
// Share of the sky that a place sees: what lies about it within `reach` (m) takes some of it.
in vec2 place;
uniform sampler2D away;
uniform vec2 tangents;
uniform float reach;
out float open;
const int TAPS = 20;
vec3 spot(vec2 where) {
  float far = textureLod(away, where, 0.0).r;
  return vec3((2.0 * where - 1.0) * tangents * far, -far);
}
void main() {
  // the middle of a pixel is the corner of four fine dots: take one of them
  vec2 step = 1.0 / vec2(textureSize(away, 0)), middle = place + 0.5 * step;
  vec3 here = spot(middle);
  if (here.z == 0.0) { open = 1.0; return; }
  vec3 right = spot(middle + vec2(step.x, 0)) - here, left = here - spot(middle - vec2(step.x, 0));
  vec3 up = spot(middle + vec2(0, step.y)) - here, down = here - spot(middle - vec2(0, step.y));
  vec3 normal = normalize(cross(abs(right.z) < abs(left.z) ? right : left, abs(up.z) < abs(down.z) ? up : down));
  float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
  vec2 wide = reach / (-here.z) / (2.0 * tangents);
  float hidden = 0.0;
  for (int k = 0; k < TAPS; k++) {
    float share = (float(k) + 0.5) / float(TAPS), turn = 6.2831853 * (share * 7.0 + noise);
    vec3 found = spot(middle + share * wide * vec2(cos(turn), sin(turn)));
    if (found.z == 0.0) continue;
    vec3 ray = found - here;
    float size = dot(ray, ray), near = max(1.0 - size / (reach * reach), 0.0);
    hidden += near * max(dot(ray, normal) - 0.02 * reach, 0.0) / (sqrt(size) + 1e-5);
  }
  open = clamp(1.0 - 3.2 * hidden / float(TAPS), 0.0, 1.0);
}
