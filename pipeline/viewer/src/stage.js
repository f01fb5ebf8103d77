// Canvas, light and camera.
import {
  AmbientLight, Box3, DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

export const CAMERAS = {
  front: [1, 0, 0.06], left: [0.001, 1, 0.06], back: [-1, 0, 0.06], above: [0.02, 0, 1], oblique: [0.85, 0.62, 0.3],
};
const FIELD = 28, ROOM = 1.06, SLOW = /swiftshader|llvmpipe|software/i, MOST_DOTS = 2;

export class Stage {
  constructor(canvas) {
    // throws where there is no WebGL
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    const gl = this.renderer.getContext(), about = gl.getExtension("WEBGL_debug_renderer_info");
    this.slow = SLOW.test(about ? gl.getParameter(about.UNMASKED_RENDERER_WEBGL) : "");
    this.canvas = canvas;
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(FIELD, 1, 0.05, 20);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    // the wheel belongs to the page until the picture has the focus
    this.controls.enableZoom = false;
    canvas.addEventListener("focus", () => { this.controls.enableZoom = true; });
    canvas.addEventListener("blur", () => { this.controls.enableZoom = false; });
    this.addLights();
    this.box = new Box3();
  }

  addLights() {
    const key = new DirectionalLight("#fff4e6", 2.1), fill = new DirectionalLight("#dfe9ff", 0.7);
    key.position.set(-0.8, 1.1, 1.4);
    fill.position.set(1.2, -0.2, 0.6);
    this.camera.add(key, key.target, fill, fill.target);
    key.target.position.set(0, 0, -1);
    fill.target.position.set(0, 0, -1);
    this.scene.add(this.camera, new HemisphereLight("#ffffff", "#8d8478", 0.9), new AmbientLight("#ffffff", 0.25));
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (!width || !height) return;
    this.renderer.setPixelRatio(this.slow ? 1 : Math.min(window.devicePixelRatio, MOST_DOTS));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  // Everything in view from a direction; `spread` moves figures apart across the screen.
  look(name, spread) {
    const way = new Vector3(...CAMERAS[name]).normalize();
    const right = new Vector3(0, 0, 1).cross(way).normalize();
    spread(right);
    const middle = this.box.getCenter(new Vector3()), size = this.box.getSize(new Vector3());
    const half = Math.tan((FIELD * Math.PI) / 360);
    const tall = name === "above" ? size.x : size.z;
    const wide = Math.abs(right.x) * size.x + Math.abs(right.y) * size.y;
    const deep = name === "above" ? size.z : Math.abs(way.x) * size.x + Math.abs(way.y) * size.y;
    const away = ROOM * Math.max(tall, wide / this.camera.aspect) / (2 * half) + deep / 4;
    this.controls.target.copy(middle);
    this.camera.position.copy(middle).addScaledVector(way, away);
    this.controls.update();
  }

  zoom(factor) {
    const { target } = this.controls;
    this.camera.position.sub(target).multiplyScalar(factor).add(target);
    this.controls.update();
  }

  render() {
    this.renderer.render(this.scene, this.camera);
  }
}
