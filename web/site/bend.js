// Bodies that are bent by hand, or fall: a live page with a maker beside its physics.
import * as THREE from 'three';
import { correctSkinNormals } from '../filigree/three_skin.js';
import { drawnVertices } from '../filigree/drawn.js';
import { Page } from '../live/page.js';

const kSway = 26, kSwaySeconds = 5;  // degrees, of a body that nobody has touched yet
const kMeasured = 150;               // ms between two measurements, at least
const kScaleOfMean = 4, kLeastEnd = 1e-7; // the colours' end: in mean errors, as a few points are far off; and at least
// From what is right to what is off.
const kColors = [[0.13, 0.29, 0.53], [0.16, 0.55, 0.60], [0.55, 0.78, 0.44], [0.98, 0.80, 0.30], [0.88, 0.30, 0.19]];

export class BendPage extends Page {
  /// maker: the worker that made the body. changed: called when what the page says of itself is to be said anew.
  constructor(file, { live, opened, worker }, maker, changed) {
    super(file, live, opened, worker);
    Object.assign(this, { maker, changed, start: opened.drivers, mode: 'bend', shows_error: false, was_touched: false });
    maker.onmessage = ({ data }) => this.hear_maker(data);
    const { mesh, model } = live.bodies[0];
    this.own_material = mesh.material;
    this.error_material = correctSkinNormals(new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.75, side: THREE.DoubleSide }));
    this.corners = drawnVertices(model).corners?.vertex;
    this.own_color = mesh.geometry.attributes.color;
    this.error_color = new THREE.BufferAttribute(new Uint8Array(4 * mesh.geometry.attributes.position.count), 4, true);
    this.straighten(); // so that there is a bend to be measured, before anybody bends
  }

  get is_bent() { return this.mode === 'bend'; }

  set_mode(mode) {
    if (mode === this.mode) return;
    this.let_go({ pointerId: this.hand?.pointer });
    this.mode = mode;
    if (mode === 'bend') this.straighten();
    else this.tell({ kind: 'drop_again' });
    this.wear();
    this.is_new = true;
    this.changed();
  }
  show_error(shows) {
    this.shows_error = shows;
    this.is_measured = false;
    this.measured_at = this.error = undefined;
    this.wear();
    this.changed();
  }
  straighten() {
    this.wanted = { bend: [0, 0, 0, 1] };
  }
  /// The body's own look, or the error's once it is known.
  wear() {
    const { mesh } = this.live.bodies[0], shows = this.error && this.is_bent;
    mesh.material = shows ? this.error_material : this.own_material;
    if (shows) mesh.geometry.setAttribute('color', this.error_color);
    else if (this.own_color) mesh.geometry.setAttribute('color', this.own_color);
    else mesh.geometry.deleteAttribute('color');
  }

  // ---- the maker

  hear_maker(data) {
    if (data.kind === 'bent') {
      this.waits_for_bend = false;
      this.spare_bend = this.bent;
      this.bent = data.driver;
      this.is_new = true;
      this.is_measured = false;
    } else if (data.kind === 'measured') {
      this.waits_for_measure = false;
      if (!this.shows_error) return;
      this.paint(data.errors);
      this.wear();
      this.changed();
    } else if (data.kind === 'failed') {
      this.fail(data.message);
    }
  }
  paint(errors) {
    let most = 0, sum = 0;
    for (const error of errors) {
      most = Math.max(most, error);
      sum += error;
    }
    const mean = sum / errors.length;
    this.error = { mean, most, end: nice(Math.max(kScaleOfMean * mean, kLeastEnd)) };
    const colors = this.error_color.array, { corners } = this, count = colors.length / 4;
    for (let k = 0; k < count; ++k) {
      const part = Math.min(errors[corners ? corners[k] : k] / this.error.end, 1) * (kColors.length - 1);
      const low = Math.min(Math.floor(part), kColors.length - 2), share = part - low;
      for (let i = 0; i < 3; ++i) {
        const value = kColors[low][i] + share * (kColors[low + 1][i] - kColors[low][i]);
        colors[4 * k + i] = 255 * value ** 2.2; // linear
      }
      colors[4 * k + 3] = 255;
    }
    this.error_color.needsUpdate = true;
  }

  // ---- in place of the physics, while it is bent

  ask(passed) {
    if (!this.is_bent) return super.ask(passed);
    if (this.is_paused) return;
    if (!this.was_touched) this.sway(passed);
    if (this.waits_for_bend) return;
    const is_due = this.bent && !this.is_measured && !this.waits_for_measure && performance.now() - (this.measured_at ?? 0) > kMeasured;
    if (this.shows_error && is_due) { // before the next bend: a hand, or the sway, asks for one in each picture
      this.waits_for_measure = this.is_measured = true;
      this.measured_at = performance.now();
      this.maker.postMessage({ kind: 'measure' });
    } else if (this.wanted) {
      this.waits_for_bend = true;
      const values = this.spare_bend;
      this.maker.postMessage({ kind: 'bend', ...this.wanted, values }, values ? [values.buffer] : []);
      this.wanted = undefined;
      this.spare_bend = undefined;
    }
  }
  /// A body that nobody has touched shows that it bends.
  sway(passed) {
    if (matchMedia('(prefers-reduced-motion: reduce)').matches) return;
    this.swayed = (this.swayed ?? 0) + passed;
    const angle = kSway * Math.sin(2 * Math.PI * this.swayed / kSwaySeconds);
    const { camera } = this.stage, aside = new THREE.Vector3(1, 0, 0).applyQuaternion(camera.quaternion);
    const towards = this.live.direction_to_world(aside).multiplyScalar(angle).toArray();
    this.wanted = { bend: [...towards, 1] };
  }
  seen() {
    return this.is_bent ? [this.bent ?? this.start[0], ...this.start.slice(1)] : super.seen();
  }
  resize() { this.stage.resize(innerWidth, innerHeight, 0, document.getElementById('bar').offsetHeight + 20, 84); }
  follow() { if (!this.is_bent) super.follow(); }
  hear(data) {
    super.hear(data);
    if (data.kind === 'moved' && data.parts !== this.told_parts) {
      this.told_parts = data.parts;
      this.changed();
    }
  }

  // ---- the hand

  press(event) {
    if (!this.is_bent) {
      super.press(event);
      if (this.hand) this.touched();
      return;
    }
    if (this.hand || !event.isPrimary || event.button !== 0) return;
    const hit = this.live.hit(this.ray_at(event));
    if (!hit) return;
    this.touched();
    this.stage.controls.enabled = false;
    event.target.setPointerCapture(event.pointerId);
    const towards = this.stage.camera.getWorldDirection(new THREE.Vector3());
    this.hand = { pointer: event.pointerId, plane: new THREE.Plane().setFromNormalAndCoplanarPoint(towards, hit.at), hit, holds: true };
  }
  pull(event) {
    if (!this.is_bent) return super.pull(event);
    if (event.pointerId !== this.hand?.pointer) return;
    const at = this.ray_at(event).intersectPlane(this.hand.plane, new THREE.Vector3());
    if (!at) return;
    const way = this.live.direction_to_world(at.sub(this.hand.hit.at));
    const holds = this.hand.holds || this.wanted?.holds;
    this.wanted = { holds, rest: this.hand.hit.rest.toArray(), way: way.toArray() };
    this.hand.holds = false;
  }
  let_go(event) {
    if (!this.is_bent) return super.let_go(event);
    if (event.pointerId !== this.hand?.pointer) return;
    this.hand = undefined;
    this.stage.controls.enabled = true;
  }
  touched() {
    if (this.was_touched) return;
    this.was_touched = true;
    this.changed();
  }

  drop_again() {
    if (!this.is_bent) return super.drop_again();
    this.touched();
    this.straighten();
    this.stage.frame();
  }
  toggle_slow() { if (!this.is_bent) super.toggle_slow(); }

  close() {
    super.close();
    this.maker.onmessage = null;
  }
}

/// 1, 2 or 5 times a power of ten, at least as large.
function nice(number) {
  const power = 10 ** Math.floor(Math.log10(number));
  return power * [1, 2, 5, 10].find((step) => step * power >= number * 0.999);
}

/// The colours of the error, for the legend.
export const error_gradient = `linear-gradient(to right, ${kColors.map((color) => `rgb(${color.map((c) => Math.round(255 * c)).join(' ')})`).join(', ')})`;
