// Bodies that move in a page: the picture, the clock, and what the user does. A worker moves the bodies.
import * as THREE from 'three';
import worker_script from 'filigree-live-worker.txt';
import { Stage } from '../src/stage.js';
import { LiveScene } from './scene.js';
import { TiltedGravity } from './tilt.js';

export const element = (id) => document.getElementById(id);
const kSlow = 1 / 8;        // of the speed, in slow motion
const kMostFrames = 4;      // of the simulation between two pictures; what is later is left out, so time slows
const kHeader = 62, kActions = 70; // pixels above and below the picture
const kRateSeconds = 1;     // over which the rate is measured
const kFollowed = 0.5;      // of the picture's radius: bodies that are further from its middle take the view along

export class Page {
  constructor(file, live, opened, worker) {
    Object.assign(this, { file, live, worker, frame_seconds: opened.frame_seconds, particles: opened.particles });
    this.speed = 1;
    this.is_paused = false;
    this.late = 0;            // s of the simulation that are to be made
    this.is_waiting = false;  // for the worker
    this.latest = this.before = opened.drivers;
    this.poses = opened.poses;
    this.times = { step: [], pose: [], draw: [], frame: [] };
    this.rates = [];          // [{ real, simulated }] of the last second
    this.end = new AbortController(); // of what listens
    live.place(opened.drivers, opened.poses);
    this.stage = new Stage(element('picture'), stage_of(live), () => {});
    this.stage.floor.visible = live.floor !== null;
    if (live.floor !== null) this.stage.floor.position.y = live.floor;
    this.tilt = new TiltedGravity(new THREE.Vector3(...file.head.gravity), this.stage.camera, live);
    worker.onmessage = ({ data }) => this.hear(data);
    this.listen();
    this.set_dark(matchMedia('(prefers-color-scheme: dark)').matches);
    element('buttons').hidden = element('actions').hidden = false;
    element('tilt').hidden = !TiltedGravity.is_there();
    element('details').hidden = !new URLSearchParams(location.search).has('details');
    this.resize();
    this.draw = this.draw.bind(this);
    requestAnimationFrame(this.draw);
  }

  // ---- the worker

  tell(message, ...moved) { this.worker.postMessage(message, ...moved); }

  hear(data) {
    if (data.kind === 'failed') return this.fail(data.message);
    if (data.kind === 'moved') {
      this.is_waiting = false;
      this.times.step.push(data.milliseconds);
      Object.assign(this, { substeps: data.substeps, contacts: data.contacts, parts: data.parts, physics_bytes: data.bytes });
      this.simulated = (this.simulated ?? 0) + data.frames * this.frame_seconds;
      this.spare = this.before === this.latest ? undefined : this.before;
      this.before = this.latest;
    } else {
      this.before = data.drivers;
      this.late = 0;
    }
    this.latest = data.drivers;
    this.poses = data.poses;
    this.is_new = true;
  }

  /// Asks for the frames that are due. Never more than a few: where the worker is late, time slows.
  ask(passed) {
    if (this.is_paused) return;
    this.late = Math.min(this.late + passed * this.speed, kMostFrames * this.frame_seconds);
    const frames = Math.floor(this.late / this.frame_seconds + 1e-6);
    if (frames === 0 || this.is_waiting) return;
    this.late -= frames * this.frame_seconds;
    this.is_waiting = true;
    const gravity = this.tilt.changed();
    if (gravity) this.tell({ kind: 'gravity', gravity });
    if (this.hand?.is_moved) {
      this.hand.is_moved = false;
      this.tell({ kind: 'move', place: this.hand.place.toArray() });
    }
    const buffers = this.spare ?? [];
    this.spare = undefined;
    this.tell({ kind: 'step', frames, buffers }, buffers.map(({ buffer }) => buffer));
  }

  // ---- drawing

  draw(now) {
    if (this.has_failed) return;
    const passed = Math.min((now - (this.last_drawn ?? now)) / 1000, 0.25); // a page in the background does not jump
    if (this.last_drawn !== undefined) this.times.frame.push(now - this.last_drawn);
    this.last_drawn = now;
    this.ask(passed);
    if (this.is_new || this.speed < 1) this.times.pose.push(this.live.place(this.seen(), this.poses));
    this.is_new = false;
    this.follow();
    const start = performance.now();
    this.stage.draw();
    this.times.draw.push(performance.now() - start);
    this.measure_rate(now / 1000);
    for (const name in this.times) if (this.times[name].length > 240) this.times[name].splice(0, 120);
    requestAnimationFrame(this.draw);
  }

  /// In slow motion what lies between two frames.
  seen() {
    if (this.speed === 1) return this.latest;
    const part = Math.min(this.late / this.frame_seconds, 1);
    return this.latest.map((after, driver) => {
      const before = this.before[driver], between = (this.between ??= [])[driver] ??= new Float32Array(after.length);
      for (let k = 0; k < after.length; ++k) between[k] = before[k] + part * (after[k] - before[k]);
      return between;
    });
  }

  /// Bodies that leave the picture take the view along.
  follow() {
    const { controls, camera, radius } = this.stage, centre = this.live.body_box().getCenter(new THREE.Vector3());
    const way = centre.sub(controls.target), excess = way.length() - kFollowed * radius;
    if (!(excess > 0) || this.hand || !Number.isFinite(excess)) return;
    way.setLength(0.08 * excess);
    controls.target.add(way);
    camera.position.add(way);
  }

  measure_rate(now) {
    this.rates.push({ real: now, simulated: this.simulated ?? 0 });
    while (this.rates.length > 2 && now - this.rates[0].real > kRateSeconds) this.rates.shift();
    const [first] = this.rates, last = this.rates.at(-1), passed = last.real - first.real;
    this.rate = passed > 0 ? (last.simulated - first.simulated) / passed : 0;
    if (element('details').hidden || now - (this.told ?? 0) < 0.25) return;
    this.told = now;
    this.fill_details();
  }

  fill_details() {
    const count = (number) => number.toLocaleString('en'), least = (list) => (list.length ? median(list).toFixed(2) : '-');
    const rows = [['particles', count(this.particles)], ['driver vertices', count(this.live.driver_vertices)],
      ['vertices', count(this.live.vertices)], ['triangles', count(this.live.triangles)],
      ['substeps', this.substeps ?? '-'], ['contacts', this.contacts ?? '-'], ...(this.parts > 0 ? [['parts', this.parts]] : []),
      ['physics, ms a frame', least(this.times.step)], ['pose, ms', least(this.times.pose)],
      ['picture, ms', least(this.times.draw)], ['pictures a second', this.times.frame.length ? (1000 / median(this.times.frame)).toFixed(0) : '-'],
      ['speed', this.rate.toFixed(2)], ['memory of the physics', `${((this.physics_bytes ?? 0) / 1e6).toFixed(1)} MB`],
      ['file', `${(this.file.bytes / 1e6).toFixed(1)} MB`]];
    element('details').replaceChildren(...rows.flatMap(([name, value]) => [text_in('dt', name), text_in('dd', value)]));
  }

  // ---- pulling

  ray_at(event) {
    const { left, top, width, height } = element('picture').getBoundingClientRect();
    const caster = new THREE.Raycaster();
    this.stage.camera.updateMatrixWorld();
    caster.setFromCamera(new THREE.Vector2(2 * (event.clientX - left) / width - 1, 1 - 2 * (event.clientY - top) / height), this.stage.camera);
    return caster.ray;
  }

  /// A pointer goes down: on a body it pulls, elsewhere it turns the view.
  press(event) {
    if (this.hand || !event.isPrimary || event.button !== 0) return;
    const ray = this.ray_at(event), hit = this.live.hit(ray);
    if (!hit) return;
    this.stage.controls.enabled = false;
    element('picture').setPointerCapture(event.pointerId);
    const towards = this.stage.camera.getWorldDirection(new THREE.Vector3());
    this.hand = { pointer: event.pointerId, plane: new THREE.Plane().setFromNormalAndCoplanarPoint(towards, hit.at) };
    this.tell({ kind: 'grab', body: hit.body, rest: hit.rest.toArray(), place: this.live.to_world(hit.at).toArray() });
  }
  pull(event) {
    if (event.pointerId !== this.hand?.pointer) return;
    const at = this.ray_at(event).intersectPlane(this.hand.plane, new THREE.Vector3());
    if (!at) return;
    if (this.live.floor !== null) at.y = Math.max(at.y, this.live.floor);
    this.hand.place = this.live.to_world(at);
    this.hand.is_moved = true;
  }
  let_go(event) {
    if (event.pointerId !== this.hand?.pointer) return;
    this.tell({ kind: 'let_go' });
    this.hand = undefined;
    this.stage.controls.enabled = true;
  }

  // ---- the other controls

  drop_again() {
    this.hand = undefined;
    this.stage.controls.enabled = true;
    this.tell({ kind: 'drop_again' });
    this.stage.frame();
  }
  toggle_slow() {
    this.speed = this.speed < 1 ? 1 : kSlow;
    element('slow').setAttribute('aria-pressed', this.speed < 1);
  }
  async toggle_tilt() {
    const is_on = await this.tilt.toggle();
    element('tilt').setAttribute('aria-pressed', is_on);
    if (this.tilt.was_refused) element('tilt').title = 'The browser does not give the position of the device to this page';
  }
  set_dark(dark) {
    this.is_dark = dark;
    document.documentElement.dataset.theme = dark ? 'dark' : 'light';
    this.stage.set_dark(dark);
  }
  resize() { this.stage.resize(innerWidth, innerHeight, 0, kActions, kHeader); }

  listen() {
    const { signal } = this.end, picture = element('picture');
    const on = (id, event, action) => element(id).addEventListener(event, action, { signal });
    picture.addEventListener('pointerdown', (event) => this.press(event), { capture: true, signal }); // before the view's
    picture.addEventListener('pointermove', (event) => this.pull(event), { signal });
    for (const end of ['pointerup', 'pointercancel']) picture.addEventListener(end, (event) => this.let_go(event), { signal });
    on('again', 'click', () => this.drop_again());
    on('slow', 'click', () => this.toggle_slow());
    on('tilt', 'click', () => this.toggle_tilt());
    on('theme', 'click', () => this.set_dark(!this.is_dark));
    on('help-button', 'click', () => element('help').showModal());
    for (const button of document.querySelectorAll('#actions button, #buttons button'))
      button.addEventListener('click', ({ detail }) => { if (detail > 0) button.blur(); }, { signal }); // so that space pauses, and does not click again
    addEventListener('resize', () => this.resize(), { signal });
    addEventListener('keydown', (event) => this.press_key(event), { signal });
  }
  press_key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || element('help').open) return;
    if (event.target.closest('button') && [' ', 'Enter'].includes(event.key)) return;
    const action = {
      ' ': () => { this.is_paused = !this.is_paused; },
      r: () => this.drop_again(),
      s: () => this.toggle_slow(),
      f: () => this.stage.frame(),
      t: () => this.set_dark(!this.is_dark),
      h: () => element('help').showModal(),
      '?': () => element('help').showModal(),
    }[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  fail(message) {
    this.has_failed = true;
    show_failure(message);
  }

  /// Another page takes its place: the picture's canvas is a new one.
  close() {
    this.has_failed = true; // nothing is drawn any more
    this.end.abort();
    this.worker.terminate();
    this.stage.controls.dispose();
    this.stage.renderer.dispose();
    this.stage.renderer.forceContextLoss();
    element('picture').replaceWith(element('picture').cloneNode());
  }
}

/// What the stage shows: the bodies and what they fall on are in the picture, and around them is room.
function stage_of(live) {
  const box = live.room(), seen = live.body_box(), reached = [];
  if (live.obstacles.some(({ is_level }) => !is_level)) seen.copy(box);
  if (live.floor !== null) seen.expandByPoint(seen.getCenter(new THREE.Vector3()).setY(live.floor));
  for (let corner = 0; corner < 8; ++corner)
    reached.push(...['x', 'y', 'z'].map((axis, k) => (corner >> k & 1 ? seen.max : seen.min)[axis]));
  return { scene: live.scene, box, reached };
}

function median(list) { return [...list].sort((a, b) => a - b)[Math.floor(list.length / 2)]; }

export function text_in(name, text) {
  const made = document.createElement(name);
  made.textContent = text;
  return made;
}

export function show_failure(message) {
  document.documentElement.dataset.theme ??= matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light';
  element('failure').hidden = false;
  element('failure-cause').textContent = /WebGL/.test(message)
    ? 'This browser does not draw in three dimensions (WebGL 2); try another one, or allow it in the settings.' : message;
  element('loading')?.setAttribute('hidden', '');
}

/// A worker that is a part of the page's own script.
export function worker_of(script) {
  return new Worker(URL.createObjectURL(new Blob([script], { type: 'text/javascript' })));
}

/// The physics of a page's file, with the bodies at their start.
function start_worker(bytes, obstacles) {
  const worker = worker_of(worker_script);
  return new Promise((resolve, reject) => {
    worker.onerror = () => reject(new Error('This browser does not run the physics (WebAssembly with SIMD); try a newer one.'));
    worker.onmessage = ({ data }) => (data.kind === 'opened' ? resolve({ worker, opened: data }) : reject(new Error(data.message)));
    worker.postMessage({ kind: 'open', world: bytes.buffer, obstacles }, [bytes.buffer]);
  });
}

/// The physics and the picture of a page's file, of open_page_file.
export async function start_bodies(file) {
  const numbers = file.head.obstacles.map(({ number }) => number);
  const [{ worker, opened }, live] = await Promise.all([start_worker(file.part(file.head.world), numbers), LiveScene.load(file)]);
  return { worker, opened, live };
}
