// Muscle fibres and error vectors: flat strips that face the eye, shaded as round ones.
import {
  Color, DynamicDrawUsage, InstancedBufferAttribute, InstancedBufferGeometry, Mesh, BufferAttribute, ShaderMaterial,
} from "three";

const VERTEX = `
  attribute vec3 start, end;
  attribute float level;
  uniform vec2 width;
  varying float across, shown;
  void main() {
    vec4 a = modelViewMatrix * vec4(start, 1.0), b = modelViewMatrix * vec4(end, 1.0);
    vec4 here = mix(a, b, position.y);
    vec3 way = b.xyz - a.xyz + vec3(1e-9);
    vec3 side = normalize(cross(way, here.xyz));
    shown = level;
    across = position.x;
    here.xyz += 0.5 * mix(width.x, width.y, level) * position.x * side;
    // a little nearer than the surface that the fibre lies in
    here.xyz *= 1.0 - 0.003 / length(here.xyz);
    gl_Position = projectionMatrix * here;
  }`;
const FRAGMENT = `
  uniform vec3 ramp[5];
  uniform float opacity;
  varying float across, shown;
  void main() {
    float place = clamp(shown, 0.0, 1.0) * 4.0;
    vec3 colour = ramp[0];
    for (int k = 1; k < 5; k++) colour = mix(colour, ramp[k], clamp(place - float(k - 1), 0.0, 1.0));
    float round = sqrt(max(0.0, 1.0 - across * across));
    gl_FragColor = vec4(colour * (0.55 + 0.45 * round), opacity);
    #include <colorspace_fragment>
  }`;

export class Ribbons {
  constructor(count, colours, width) {
    const geometry = new InstancedBufferGeometry();
    const corners = new Float32Array([-1, 0, 0, 1, 0, 0, 1, 1, 0, -1, 1, 0]);
    geometry.setAttribute("position", new BufferAttribute(corners, 3));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    geometry.instanceCount = count;
    for (const [name, size] of [["start", 3], ["end", 3], ["level", 1]]) {
      const attribute = new InstancedBufferAttribute(new Float32Array(size * count), size);
      attribute.setUsage(DynamicDrawUsage);
      geometry.setAttribute(name, attribute);
      this[name] = attribute;
    }
    this.material = new ShaderMaterial({
      vertexShader: VERTEX, fragmentShader: FRAGMENT, side: 2,
      uniforms: {
        ramp: { value: colours.map((c) => new Color(c)) }, opacity: { value: 1 }, width: { value: width },
      },
    });
    this.mesh = new Mesh(geometry, this.material);
    this.mesh.frustumCulled = false;
  }

  setOpacity(opacity) {
    this.mesh.visible = opacity > 0.01;
    this.material.uniforms.opacity.value = opacity;
    this.material.transparent = opacity < 0.99;
    this.material.depthWrite = opacity >= 0.99;
  }

  changed() {
    for (const name of ["start", "end", "level"]) this[name].needsUpdate = true;
  }
}
