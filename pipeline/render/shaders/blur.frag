#version 330
// Mean of the neighbours that are as far away: takes the grain out and leaves the edges.
in vec2 place;
uniform sampler2D open;
uniform sampler2D away;
uniform float reach;
out float smoothed;
void main() {
  vec2 step = 1.0 / vec2(textureSize(open, 0)), dot_ = 0.5 / vec2(textureSize(away, 0));
  float here = textureLod(away, place + dot_, 0.0).r, sum = 0.0, weight = 1e-6;
  for (int i = -2; i <= 2; i++) for (int j = -2; j <= 2; j++) {
    vec2 there = place + vec2(i, j) * step;
    float like = max(0.0, 1.0 - 4.0 * abs(textureLod(away, there + dot_, 0.0).r - here) / reach);
    sum += like * textureLod(open, there, 0.0).r;
    weight += like;
  }
  smoothed = sum / weight;
}
