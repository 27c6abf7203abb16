// What is seen: the body's skin on a table, lit from above.
import {
  BufferAttribute,
  BufferGeometry,
  CircleGeometry,
  Color,
  DirectionalLight,
  DynamicDrawUsage,
  HemisphereLight,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshStandardMaterial,
  PCFSoftShadowMap,
  PerspectiveCamera,
  Plane,
  PlaneGeometry,
  Raycaster,
  Scene,
  ShadowMaterial,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

const paper = new Color(0xf4f3ef);
const skins = {
  cube: { color: 0x4c78a8, roughness: 0.65, flatShading: true },
  liver: { color: 0x8c3b34, roughness: 0.42, flatShading: false },
};

export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFSoftShadowMap;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.scene = new Scene();
    this.scene.background = paper;
    this.camera = new PerspectiveCamera(32, 1, 0.01, 20);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enablePan = false;
    this.controls.enableDamping = false;
    this.controls.minDistance = 0.3;
    this.controls.maxDistance = 3;
    this.controls.listenToKeyEvents?.(canvas);
    this.scene.add(new HemisphereLight(0xffffff, 0xb8b2a6, 1.7));
    this.light = new DirectionalLight(0xffffff, 2.2);
    this.light.castShadow = true;
    this.light.shadow.mapSize.set(1024, 1024);
    this.light.shadow.radius = 6;
    this.light.shadow.bias = -0.0005;
    this.light.shadow.normalBias = 0.006;
    this.scene.add(this.light, this.light.target);
    this.floor = new Mesh(new CircleGeometry(4, 64).rotateX(-Math.PI / 2), new ShadowMaterial({ opacity: 0.16 }));
    this.floor.receiveShadow = true;
    this.scene.add(this.floor);
    this.plates = [1, -1].map((side) => {
      const geometry = new PlaneGeometry(1, 1).rotateX((-side * Math.PI) / 2);
      return new Mesh(geometry, new MeshStandardMaterial({ color: 0x9b958a, transparent: true, opacity: 0.35, side: 2 }));
    });
    this.scene.add(...this.plates);
    this.ray = new Raycaster();
    this.blade = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0x222222 }));
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / Math.max(1, height);
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  /** Another body: looks at it from the front, a little from above. */
  show(subject) {
    const [x, y, z] = subject.centre;
    const { size } = subject;
    const low = subject.settings.stage === "floor" ? subject.floor : subject.settings.body === "cube" ? 0 : -0.3 * size;
    this.floor.position.set(x, low - 0.001, z);
    const target = new Vector3(x, subject.settings.stage === "floor" ? y - 0.1 * size : y, z);
    if (!this.shown || this.shown !== subject.settings.body) {
      // Upright and narrow windows see it from further away.
      const away = (subject.settings.body === "cube" ? 3.9 : 3.3) * size * Math.max(1, 0.9 / this.camera.aspect);
      this.camera.position.copy(target).add(new Vector3(0.62, 0.42, 0.9).normalize().multiplyScalar(away));
      this.shown = subject.settings.body;
    }
    this.controls.target.copy(target);
    this.controls.update();
    this.light.position.set(x + 0.6 * size, y + 3 * size, z + 1.2 * size);
    this.light.target.position.set(x, y, z);
    const camera = this.light.shadow.camera;
    Object.assign(camera, { left: -1.6 * size, right: 1.6 * size, top: 1.6 * size, bottom: -1.6 * size, near: size, far: 6 * size });
    camera.updateProjectionMatrix();
    this.plates.forEach((plate) => plate.scale.set(1.5 * size, 1, 1.5 * size));
    this.#mesh(subject);
  }

  #mesh(subject) {
    if (this.mesh) {
      this.scene.remove(this.mesh, this.grid);
      [this.mesh, this.grid].forEach((one) => (one.geometry.dispose(), one.material.dispose()));
    }
    const count = subject.skin.positions.length;
    this.positions = new BufferAttribute(new Float32Array(count), 3).setUsage(DynamicDrawUsage);
    this.normals = new BufferAttribute(new Float32Array(count), 3).setUsage(DynamicDrawUsage);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", this.positions);
    geometry.setAttribute("normal", this.normals);
    geometry.setIndex(new BufferAttribute(subject.triangles, 1));
    this.mesh = new Mesh(geometry, new MeshStandardMaterial({ side: 2, ...skins[subject.settings.body] }));
    this.mesh.castShadow = true;
    this.mesh.receiveShadow = true;
    this.mesh.frustumCulled = false;
    const grid = new BufferGeometry();
    grid.setAttribute("position", this.positions);
    grid.setIndex(subject.settings.body === "cube" ? this.#cellEdges(subject) : []);
    this.grid = new LineSegments(grid, new LineBasicMaterial({ color: 0x1d3a5c, transparent: true, opacity: 0.28 }));
    this.grid.frustumCulled = false;
    this.scene.add(this.mesh, this.grid);
    subject.skinChanged = false;
  }

  /** Sides of triangles that lie along an axis at rest: not the faces' diagonals. */
  #cellEdges(subject) {
    const mesh = subject.triangles;
    const x = subject.restSkin;
    const edges = [];
    for (let t = 0; t < mesh.length; ++t) {
      const [p, q] = [mesh[t], mesh[t % 3 === 2 ? t - 2 : t + 1]];
      const along = [0, 1, 2].filter((c) => Math.abs(x[3 * p + c] - x[3 * q + c]) > 1e-9);
      if (along.length === 1 && p < q) {
        edges.push(p, q);
      }
    }
    return edges;
  }

  draw(subject) {
    if (subject.skinChanged) {
      this.#mesh(subject);
    }
    subject.skin.update(subject.dynamics);
    this.positions.array.set(subject.skin.positions);
    this.normals.array.set(subject.skin.normals);
    this.positions.needsUpdate = true;
    this.normals.needsUpdate = true;
    this.plates.forEach((plate, i) => {
      plate.visible = subject.settings.stage === "plates";
      const pose = subject.obstacles[i]?.pose;
      if (plate.visible && pose) plate.position.set(...pose.position);
    });
    this.renderer.render(this.scene, this.camera);
  }

  // ---- the pointer

  #aim(x, y) {
    const box = this.canvas.getBoundingClientRect();
    const at = new Vector2(((x - box.left) / box.width) * 2 - 1, 1 - ((y - box.top) / box.height) * 2);
    this.ray.setFromCamera(at, this.camera);
  }

  /** Where the pointer meets the body; null beside it. */
  pick(x, y) {
    this.#aim(x, y);
    this.mesh.geometry.computeBoundingSphere();
    const [hit] = this.ray.intersectObject(this.mesh);
    if (!hit) {
      return null;
    }
    // Pulls stay in the plane through that point that faces the eye.
    this.pullPlane = new Plane().setFromNormalAndCoplanarPoint(this.camera.getWorldDirection(new Vector3()), hit.point);
    return hit.point.toArray();
  }
  /** Where the pointer is in that plane. */
  follow(x, y) {
    this.#aim(x, y);
    const point = this.ray.ray.intersectPlane(this.pullPlane, new Vector3());
    return point?.toArray() ?? null;
  }
  /** A point of space on the screen, in pixels, and how large a metre is there. */
  project(point) {
    const box = this.canvas.getBoundingClientRect();
    const at = new Vector3(...point);
    const distance = at.distanceTo(this.camera.position);
    at.project(this.camera);
    const metre = box.height / (2 * distance * Math.tan((this.camera.fov * Math.PI) / 360));
    return { x: box.left + ((at.x + 1) / 2) * box.width, y: box.top + ((1 - at.y) / 2) * box.height, metre };
  }
}
