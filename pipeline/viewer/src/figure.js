// One trajectory as meshes: rigid shapes, soft surfaces, muscles, markers.
import {
  BufferAttribute, BufferGeometry, DoubleSide, DynamicDrawUsage, FrontSide, Group, InstancedMesh, Matrix4, Mesh,
  MeshStandardMaterial, OctahedronGeometry, SphereGeometry, Vector3,
} from "three";
import { Pose } from "./points.js";
import { Ribbons } from "./ribbons.js";
import { Skin } from "./skin.js";

export const RAMP = ["#a79fc4", "#8f0da4", "#cc4778", "#f2844b", "#fdca26"];
const VECTOR = Array(5).fill("#d4272e");
const FIBRE = [0.0022, 0.0058], ARROW = [0.0035, 0.0035], MARKER = 0.005;
// A solid surface is drawn a little nearer, so that bones that lie in it do not show through.
const NEARER = -1200;

// Where a surface is seen edge on it hides more: a shell of glass rather than a veil.
function glass(material) {
  material.onBeforeCompile = (shader) => {
    shader.fragmentShader = shader.fragmentShader.replace(
      "#include <opaque_fragment>",
      `#ifndef OPAQUE
        float edge = 1.0 - abs(dot(normalize(normal), normalize(vViewPosition)));
        diffuseColor.a *= mix(mix(0.45, 1.0, edge * edge), 1.0, diffuseColor.a);
      #endif
      #include <opaque_fragment>`);
  };
  return material;
}

class Layer {
  constructor(row) {
    this.row = row;
    this.meshes = [];
    this.opacity = 0;
    const soft = row.kind === "soft";
    this.material = new MeshStandardMaterial({
      color: row.colour, roughness: soft ? 0.6 : 0.75, metalness: 0, side: DoubleSide,
      polygonOffset: soft, polygonOffsetUnits: NEARER,
    });
    if (soft) glass(this.material);
  }

  add(mesh) {
    mesh.renderOrder = this.row.order;
    this.meshes.push(mesh);
  }

  setOpacity(opacity) {
    this.opacity = opacity;
    const solid = opacity >= 0.99;
    for (const mesh of this.meshes) mesh.visible = opacity > 0.01;
    if (this.material.transparent === solid) this.material.needsUpdate = true;
    // far sides of bones that are seen through only blur them
    const side = solid || this.row.kind === "soft" ? DoubleSide : FrontSide;
    Object.assign(this.material, { opacity, side, transparent: !solid, depthWrite: solid });
  }
}

export class Figure {
  constructor(told, rows, store) {
    this.told = told;
    this.group = new Group();
    this.pose = new Pose(told, store);
    this.layers = Object.fromEntries(rows.map((row) => [row.layer, new Layer(row)]));
    this.rigid = [];
    this.soft = [];
    this.skins = [];
    this.factor = 1;
    this.centred = true;
    this.hiddenGroups = new Set();
    this.pace = 1;
    this.addShapes(store);
    this.addSurfaces(store);
    if (told.muscles) this.addMuscles(store);
    this.addMarkers(store);
  }

  has(row) {
    if (row.kind === "muscles") return Boolean(this.muscles);
    if (row.kind === "markers") return this.told.markers.names.length > 0;
    return this.layers[row.layer].meshes.length > 0;
  }

  addShapes(store) {
    for (const shape of this.told.bodies.shapes) {
      const geometry = new BufferGeometry();
      geometry.setAttribute("position", new BufferAttribute(store.values(shape.vertices), 3));
      geometry.setIndex(new BufferAttribute(store.whole(shape.faces), 1));
      geometry.computeVertexNormals();
      const layer = this.layers[shape.layer], mesh = new Mesh(geometry, layer.material);
      mesh.matrixAutoUpdate = false;
      mesh.name = shape.name;
      layer.add(mesh);
      this.group.add(mesh);
      this.rigid.push([mesh, shape.body]);
    }
  }

  addSurfaces(store) {
    for (const surface of this.told.surfaces) {
      const layer = this.layers[surface.layer];
      if (!layer) continue;
      const skin = surface.skin && new Skin(surface.skin, store);
      const points = surface.skin ? null : store.whole(surface.points), geometry = new BufferGeometry();
      const position = new BufferAttribute(new Float32Array(3 * (skin || points).length), 3);
      geometry.setAttribute("position", position.setUsage(DynamicDrawUsage));
      geometry.setIndex(new BufferAttribute(store.whole(surface.faces), 1));
      const mesh = new Mesh(geometry, layer.material);
      mesh.frustumCulled = false;
      layer.add(mesh);
      this.group.add(mesh);
      if (skin) this.skins.push([mesh, skin]);
      else this.soft.push([mesh, points]);
    }
  }

  addMuscles(store) {
    const { ends, tension, group, groups, most_n: most } = this.told.muscles;
    this.muscles = {
      ends: store.whole(ends), tension: store.whole(tension), group: store.whole(group), groups, most,
    };
    this.fibres = new Ribbons(ends.shape[0], RAMP, FIBRE);
    this.fibres.mesh.renderOrder = this.layers.muscles.row.order;
    this.group.add(this.fibres.mesh);
  }

  addMarkers(store) {
    const { names, simulated, measured, seen } = this.told.markers;
    this.simulated = store.values(simulated);
    const material = (color) => new MeshStandardMaterial({
      color, roughness: 0.4, polygonOffset: true, polygonOffsetUnits: 2 * NEARER,
    });
    const instances = (geometry, colour) => {
      const mesh = new InstancedMesh(geometry, material(colour), Math.max(names.length, 1));
      mesh.count = names.length;
      mesh.frustumCulled = false;
      mesh.renderOrder = 8;
      this.group.add(mesh);
      return mesh;
    };
    this.balls = instances(new SphereGeometry(MARKER, 16, 12), "#e0702a");
    if (!measured) return;
    this.measured = store.values(measured);
    this.seen = seen;
    this.stones = instances(new OctahedronGeometry(1.3 * MARKER), "#2b6cb0");
    this.arrows = new Ribbons(names.length, VECTOR, ARROW);
    this.arrows.mesh.renderOrder = 8;
    this.group.add(this.arrows.mesh);
    const frames = this.pose.time.length, row = 3 * names.length;
    this.offset = new Float32Array(row);
    for (let f = 0; f < frames; f++) {
      for (let i = 0; i < row; i++) {
        this.offset[i] += (this.measured[f * row + i] - this.simulated[f * row + i]) / frames;
      }
    }
  }

  setOpacity(layer, opacity) {
    const { kind } = this.layers[layer].row;
    this.layers[layer].setOpacity(opacity);
    if (kind === "muscles" && this.fibres) this.fibres.setOpacity(opacity);
    if (kind === "markers") {
      for (const mesh of [this.balls, this.stones, this.arrows?.mesh]) if (mesh) mesh.visible = opacity > 0.01;
      for (const mesh of [this.balls, this.stones]) {
        if (mesh) Object.assign(mesh.material, { opacity, transparent: opacity < 0.99 });
      }
    }
  }

  // Its frames by the clock.
  times() {
    return Array.from(this.pose.time, (t) => t + this.told.delay);
  }

  // `time` of the clock; before its first frame and after its last one a torso stands still.
  // `pace`: how much faster its own time goes.
  update(time) {
    this.pose.update((time - this.told.delay) * this.pace);
    for (const [mesh, body] of this.rigid) mesh.matrix.copy(this.pose.matrices[body]);
    const { points } = this.pose;
    for (const [mesh, index] of this.soft) {
      if (!mesh.visible) continue;
      const { array } = mesh.geometry.attributes.position;
      for (let v = 0; v < index.length; v++) {
        const i = 3 * index[v];
        array[3 * v] = points[i];
        array[3 * v + 1] = points[i + 1];
        array[3 * v + 2] = points[i + 2];
      }
      mesh.geometry.attributes.position.needsUpdate = true;
      mesh.geometry.computeVertexNormals();
    }
    for (const [mesh, skin] of this.skins) {
      if (!mesh.visible) continue;
      skin.place(this.pose, mesh.geometry.attributes.position.array);
      mesh.geometry.attributes.position.needsUpdate = true;
      mesh.geometry.computeVertexNormals();
    }
    if (this.fibres?.mesh.visible) this.updateMuscles();
    if (this.balls.visible) this.updateMarkers();
  }

  updateMuscles() {
    const { ends, tension, group, groups } = this.muscles, { start, end, level } = this.fibres;
    const n = group.length, { points } = this.pose;
    for (let e = 0; e < n; e++) {
      const a = 3 * ends[2 * e], hidden = this.hiddenGroups.has(groups[group[e]]);
      const b = hidden ? a : 3 * ends[2 * e + 1];
      for (let c = 0; c < 3; c++) {
        start.array[3 * e + c] = points[a + c];
        end.array[3 * e + c] = points[b + c];
      }
      level.array[e] = this.pose.mix(tension, n, e) / 255;
    }
    this.fibres.changed();
  }

  // Measured place as shown: about the simulated one, enlarged, with or without the mean offset.
  away(i) {
    const row = this.simulated.length / this.pose.time.length;
    const shift = this.pose.mix(this.measured, row, i) - this.pose.mix(this.simulated, row, i);
    return shift - (this.centred ? this.offset[i] : 0);
  }

  updateMarkers() {
    const n = this.told.markers.names.length, matrix = new Matrix4(), at = new Vector3();
    this.places = this.places || new Float32Array(3 * n);
    for (let m = 0; m < n; m++) {
      const place = [0, 1, 2].map((c) => this.pose.mix(this.simulated, 3 * n, 3 * m + c));
      this.places.set(place, 3 * m);
      this.balls.setMatrixAt(m, matrix.makeTranslation(at.fromArray(place)));
      if (!this.measured) continue;
      const moved = place.map((x, c) => x + this.factor * this.away(3 * m + c));
      if (this.seen[m]) matrix.makeTranslation(at.fromArray(moved));
      else matrix.makeScale(0, 0, 0);
      this.stones.setMatrixAt(m, matrix);
      this.arrows.start.array.set(place, 3 * m);
      this.arrows.end.array.set(this.seen[m] ? moved : place, 3 * m);
      this.arrows.level.array[m] = 1;
    }
    this.balls.instanceMatrix.needsUpdate = true;
    if (!this.measured) return;
    this.stones.instanceMatrix.needsUpdate = true;
    this.arrows.changed();
  }

  // Mean distance of measured from simulated markers now, in mm.
  error() {
    if (!this.measured) return null;
    const seen = this.seen.flatMap((yes, m) => (yes ? [m] : []));
    const sum = seen.reduce((s, m) => s + Math.hypot(...[0, 1, 2].map((c) => this.away(3 * m + c))), 0);
    return 1e3 * sum / Math.max(seen.length, 1);
  }

  // Over all frames, in mm, offsets left out.
  meanError() {
    const { time } = this.pose, told = [];
    for (const t of time) { this.pose.locate(t); told.push(this.error()); }
    return told.reduce((a, b) => a + b, 0) / told.length;
  }

  series(k) {
    return this.pose.mix(this.told.series[k].values, 1, 0);
  }
}
