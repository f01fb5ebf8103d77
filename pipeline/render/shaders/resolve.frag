#version 330
// Mean of the fine dots of each pixel, on the background, as a screen wants it.
in vec2 place;
uniform sampler2D fine;
uniform vec3 middle;
uniform vec3 rim;
uniform bool clear;
uniform float aspect;
uniform int times;
out vec4 colour;
vec3 encoded(vec3 x) {
  x = clamp(x, 0.0, 1.0);
  return mix(12.92 * x, 1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, x));
}
void main() {
  ivec2 first = times * ivec2(gl_FragCoord.xy);
  vec4 sum = vec4(0.0);
  for (int i = 0; i < times; i++) for (int j = 0; j < times; j++) {
    vec4 dot_ = texelFetch(fine, first + ivec2(i, j), 0);
    // what is brighter than white would drown its neighbours
    sum += vec4(min(dot_.rgb, vec3(dot_.a)), dot_.a);
  }
  sum /= float(times * times);
  if (clear) { colour = vec4(encoded(sum.rgb / max(sum.a, 1e-4)), sum.a); return; }
  vec2 off = (place - vec2(0.5, 0.55)) * vec2(min(aspect, 1.6), 1.0);
  vec3 behind = mix(middle, rim, smoothstep(0.1, 0.95, length(off)));
  vec3 shown = encoded(sum.rgb + (1.0 - sum.a) * behind);
  // half a step of grain hides the bands of a soft background
  float grain = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)))) - 0.5;
  colour = vec4(shown + grain / 255.0, 1.0);
}
