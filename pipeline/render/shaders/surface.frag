#version 330
// A lit surface, solid or of glass. Lights hang on the eye, as in the viewer.
in vec3 at;
in vec3 facing;
in vec3 albedo;
uniform sampler2D open;
uniform sampler2DShadow shadow;
uniform mat4 to_light;
uniform vec3 up;
uniform vec3 key;
uniform vec2 size;
uniform float opacity;
uniform bool solid;
uniform bool glass;
out vec4 light;
const vec3 KEY = vec3(0.98, 0.91, 0.82), FILL = vec3(0.13, 0.16, 0.21), RIM = vec3(0.30, 0.33, 0.38);
const vec3 SKY = vec3(0.40, 0.43, 0.48), EARTH = vec3(0.17, 0.145, 0.125);
const vec3 FILL_WAY = normalize(vec3(0.9, 0.05, 0.5)), RIM_WAY = normalize(vec3(0.35, 0.75, -0.75));
// of the shadow's picture, that its edge is soft over
const float SOFT = 0.004;
float lit(vec3 normal) {
  vec4 seen = to_light * vec4(at + 0.004 * normal, 1.0);
  vec3 spot = 0.5 * seen.xyz / seen.w + 0.5;
  float noise = 6.2831853 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
  // what is lit from aside is as much deeper within the reach of the taps as it is steep
  float high = max(dot(normal, key), 0.2), steep = sqrt(1.0 - high * high) / high, sum = 0.0;
  for (int k = 0; k < 12; k++) {
    float turn = 2.3999632 * float(k) + noise, far = SOFT * sqrt((float(k) + 0.5) / 12.0);
    vec2 there = spot.xy + far * vec2(cos(turn), sin(turn));
    sum += texture(shadow, vec3(there, spot.z - 0.0008 - SOFT * steep));
  }
  return sum / 12.0;
}
void main() {
  vec3 eye = normalize(-at), normal = normalize(facing);
  if (dot(normal, eye) < 0.0) normal = -normal;
  float sky = solid ? texture(open, gl_FragCoord.xy / size).r : 1.0;
  float sun = solid ? lit(normal) : 1.0;
  float key_part = max((dot(normal, key) + 0.15) / 1.15, 0.0) * sun;
  float fill_part = max((dot(normal, FILL_WAY) + 0.3) / 1.3, 0.0) * (0.4 + 0.6 * sky);
  float rim_part = max(dot(normal, RIM_WAY), 0.0) * sky;
  vec3 around = mix(EARTH, SKY, 0.5 + 0.5 * dot(normal, up)) * sky;
  vec3 half_way = normalize(key + eye);
  float shine = 0.10 * pow(max(dot(normal, half_way), 0.0), 28.0) * sun;
  float edge = 1.0 - abs(dot(normal, eye));
  vec3 colour = albedo * (around + KEY * key_part + FILL * fill_part + RIM * rim_part)
    + vec3(shine) + 0.04 * sky * pow(edge, 4.0);
  // bright places bend towards white instead of breaking off
  colour = 1.3 * colour * (1.0 + 0.33 * colour) / (1.0 + 0.95 * colour);
  float much = opacity;
  if (glass) much *= mix(mix(0.45, 1.0, edge * edge), 1.0, opacity);
  light = vec4(colour * much, much);
}
