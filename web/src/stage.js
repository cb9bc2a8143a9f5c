// What the model stands on, is lit by and is seen from.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

const kFieldOfView = 30; // degrees
const kFilled = 0.86;    // of the picture, by the model

/// Draws `model` into a canvas. Nothing is drawn unless draw() is called; `on_change` is called when the view moves.
export class Stage {
  constructor(canvas, model, on_change) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.toneMapping = THREE.NeutralToneMapping;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.scene = new THREE.Scene();

    this.box = model.box;
    this.centre = this.box.getCenter(new THREE.Vector3());
    this.radius = Math.max(this.box.getSize(new THREE.Vector3()).length() / 2, 1e-9);
    this.scene.add(model.scene, this.lights(), this.ground());

    this.camera = new THREE.PerspectiveCamera(kFieldOfView, 1, 0.01 * this.radius, 100 * this.radius);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = !matchMedia('(prefers-reduced-motion: reduce)').matches;
    this.controls.dampingFactor = 0.12;
    this.controls.minDistance = 0.05 * this.radius;
    this.controls.maxDistance = 30 * this.radius;
    this.controls.addEventListener('change', on_change);
    this.controls.addEventListener('start', () => { this.was_turned = true; });
  }

  lights() {
    const sun = new THREE.DirectionalLight(0xfff4e6, 2.0);
    sun.target.position.copy(this.centre);
    sun.position.copy(this.centre).addScaledVector(new THREE.Vector3(0.55, 1, 0.6).normalize(), 4 * this.radius);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    const reach = 1.5 * this.radius;
    Object.assign(sun.shadow.camera, { left: -reach, right: reach, top: reach, bottom: -reach, near: this.radius, far: 7 * this.radius });
    sun.shadow.radius = 4;
    sun.shadow.bias = -4e-4;
    sun.shadow.normalBias = 0.012 * this.radius;
    const back = new THREE.DirectionalLight(0xcfe0ff, 0.9);
    back.target = sun.target;
    back.position.copy(this.centre).add(new THREE.Vector3(-0.7, 0.35, -0.8));
    this.sky = new THREE.HemisphereLight(0xffffff, 0xa79f96, 1);
    const group = new THREE.Group();
    group.add(sun, sun.target, back, this.sky);
    return group;
  }

  /// A floor under the lowest place that the animation reaches: a faint grid, and the shadow.
  ground() {
    const floor = new THREE.Group();
    floor.position.set(this.centre.x, this.box.min.y, this.centre.z);
    floor.rotation.x = -Math.PI / 2;
    const disc = new THREE.CircleGeometry(6 * this.radius, 64);
    const shadow = new THREE.Mesh(disc, new THREE.ShadowMaterial({ opacity: 0.22, depthWrite: false }));
    shadow.receiveShadow = true;
    const spacing = 10 ** Math.floor(Math.log10(this.radius));
    this.grid = new THREE.ShaderMaterial({
      transparent: true,
      depthWrite: false,
      uniforms: {
        ink: { value: new THREE.Color() },
        spacing: { value: spacing },
        offset: { value: new THREE.Vector2(this.centre.x, -this.centre.z) },
        reach: { value: 4.5 * this.radius },
      },
      vertexShader: `
        varying vec2 at;
        void main() { at = position.xy; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`,
      fragmentShader: `
        uniform vec3 ink;
        uniform float spacing, reach;
        uniform vec2 offset;
        varying vec2 at;
        float lines(float distance) {
          vec2 cell = (at + offset) / distance, width = fwidth(cell);
          vec2 near = abs(fract(cell - 0.5) - 0.5) / width;
          return max(1.0 - min(near.x, near.y), 0.0) * (1.0 - smoothstep(0.1, 0.5, max(width.x, width.y)));
        }
        void main() {
          float fade = smoothstep(reach, 0.15 * reach, length(at));
          gl_FragColor = vec4(ink, fade * max(0.07 * lines(spacing), 0.18 * lines(10.0 * spacing)));
          #include <colorspace_fragment>
        }`,
    });
    const lines = new THREE.Mesh(disc, this.grid);
    shadow.renderOrder = lines.renderOrder = -1;
    floor.add(shadow, lines);
    this.floor = floor;
    return floor;
  }

  set_dark(dark) {
    this.grid.uniforms.ink.value.set(dark ? 0xffffff : 0x20242a);
    this.sky.intensity = dark ? 1.1 : 1.6;
  }

  /// right, bottom: pixels of the picture that something else covers; the model is put in the middle of the rest.
  resize(width, height, right, bottom) {
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.height = height * this.renderer.getPixelRatio(); // pixels of the screen
    this.camera.aspect = width / height;
    this.free = { width: width - right, height: height - bottom };
    this.camera.setViewOffset(width, height, right / 2, bottom / 2, width, height);
    if (!this.was_turned) this.frame(); // a view that the user chose stays
  }

  /// All of the animation in the picture, seen from the front and a little from above.
  frame() {
    this.was_turned = false;
    const { width, height } = this.free, full = this.renderer.getSize(new THREE.Vector2());
    const tangent = Math.tan((kFieldOfView / 2) * (Math.PI / 180));
    const direction = new THREE.Vector3(0.45, 0.32, 1).normalize();
    this.controls.target.copy(this.centre);
    this.camera.position.copy(this.centre).addScaledVector(direction, 
      this.distance(direction, (tangent * width) / full.y, (tangent * height) / full.y));
    this.controls.update();
  }

  /// How far away all corners of the box lie within the given tangents of the view's half angles.
  distance(direction, across, upwards) {
    const right = new THREE.Vector3(0, 1, 0).cross(direction).normalize(), up = direction.clone().cross(right);
    const corner = new THREE.Vector3();
    let distance = 0;
    for (let i = 0; i < 8; ++i) {
      corner.set(i & 1 ? this.box.max.x : this.box.min.x, i & 2 ? this.box.max.y : this.box.min.y,
        i & 4 ? this.box.max.z : this.box.min.z).sub(this.centre);
      const away = Math.max(Math.abs(corner.dot(right)) / across, Math.abs(corner.dot(up)) / upwards);
      distance = Math.max(distance, corner.dot(direction) + away / kFilled);
    }
    return distance;
  }

  /// Whether the view is still moving.
  draw() {
    const moves = this.controls.update();
    this.renderer.render(this.scene, this.camera);
    return moves;
  }
}
