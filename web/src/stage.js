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

    this.model = model;
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

  /// right, bottom, top: pixels of the picture that something else covers; the model is put in the middle of the rest.
  resize(width, height, right, bottom, top) {
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.height = height * this.renderer.getPixelRatio(); // pixels of the screen
    this.camera.aspect = width / height;
    this.free = { width: width - right, height: height - bottom - top };
    this.camera.setViewOffset(width, height, right / 2, (bottom - top) / 2, width, height);
    if (!this.was_turned) this.frame(); // a view that the user chose stays
  }

  /// All places of the animation in the picture, as large as can be, seen from the front and a little from above.
  frame() {
    this.was_turned = false;
    const { width, height } = this.free, full = this.renderer.getSize(new THREE.Vector2());
    const tangent = (kFilled * Math.tan((kFieldOfView / 2) * (Math.PI / 180))) / full.y;
    const direction = new THREE.Vector3(0.45, 0.32, 1).normalize();
    const right = new THREE.Vector3(0, 1, 0).cross(direction).normalize(), up = direction.clone().cross(right);
    const across = this.fit(right, direction, tangent * width), upwards = this.fit(up, direction, tangent * height);
    this.controls.target.copy(this.centre).addScaledVector(right, across.middle).addScaledVector(up, upwards.middle);
    this.camera.position.copy(this.controls.target).addScaledVector(direction, Math.max(across.distance, upwards.distance));
    this.controls.update();
  }

  /// Where along `axis` to look, and how far from the box's centre, so that all places lie within a tangent of the view's
  /// half angle.
  fit(axis, direction, tangent) {
    const { reached } = this.model, p = new THREE.Vector3();
    let low = -Infinity, high = -Infinity;
    for (let i = 0; i < reached.length; i += 3) {
      p.fromArray(reached, i).sub(this.centre);
      const along = p.dot(direction), aside = p.dot(axis) / tangent;
      low = Math.max(low, along - aside);
      high = Math.max(high, along + aside);
    }
    return { middle: (tangent * (high - low)) / 2, distance: (low + high) / 2 };
  }

  /// Whether the view is still moving.
  draw() {
    const moves = this.controls.update();
    this.renderer.render(this.scene, this.camera);
    return moves;
  }
}
