// The standing page: a visitor gives a mesh of their own, and it bends, falls and breaks. Nothing leaves the page.
import maker_script from 'filigree-site-worker.txt';
import { element, show_failure, start_bodies, worker_of } from '../live/page.js';
import { open_page_file } from '../live/page_file.js';
import { BendPage, error_gradient } from './bend.js';

const kMostBytes = 400e6; // of a file
/// Shapes of the library's own.
const kSamples = [
  { label: 'Sphere', shape: 'wavy-sphere', resolution: 90, frequency: 9, amplitude: 0.045 },
  { label: 'Ring', shape: 'torus', resolution: 220, frequency: 14, amplitude: 0.035 },
  { label: 'Bar', shape: 'bar', resolution: 40, frequency: 0, amplitude: 0 },
];
const kSoft = { material: 'soft-rubber', particles: 2500, tilt: 12 };
const kBrittle = { material: 'plaster', young_modulus: 1e6, particles: 1500, pieces: 24, tilt: 20 };
/// What the library calls its work, for people.
const kPhases = [[/read/i, 'Reading it'], [/simplify|bind|sampling/, 'Taking the detail off'], [/break|cut|piece/, 'Cutting it into pieces'],
  [/spacing|darts|inside|winding|scan|counting|spread/, 'Filling it with particles']];

const count = (number) => number.toLocaleString('en');
const percent = (part) => `${(100 * part).toLocaleString('en', { maximumSignificantDigits: 2 })}\u00a0%`; // in one line

class Site {
  constructor() {
    this.breaks = false;
    this.runs = 0; // how many bodies were asked for: what an earlier one says is not heard
    element('ramp').style.background = error_gradient;
    element('samples').replaceChildren(...kSamples.map((sample) => {
      const button = document.createElement('button');
      button.textContent = sample.label;
      button.addEventListener('click', () => this.take({ sample }));
      return button;
    }));
    this.listen();
    this.take({ sample: kSamples[0] });
  }

  // ---- making

  /// given: { file } of the visitor's, or { sample }.
  async take(given) {
    const { file, sample } = given, name = file?.name ?? sample.label;
    const asked = ++this.runs;
    this.maker_next?.terminate();
    try {
      if (file?.size > kMostBytes) throw new Error(`${name} has ${(file.size / 1e6).toFixed(0)} MB, and this page takes files of up to ${kMostBytes / 1e6} MB.`);
      this.say('Reading it');
      const bytes = file && await file.arrayBuffer().catch(() => { throw new Error(`${name} cannot be read.`); });
      if (asked !== this.runs) return;
      const maker = this.maker_next = worker_of(maker_script);
      const read = await this.ask(maker, { kind: 'read', module: this.module, name, bytes, sample }, 'read', bytes ? [bytes] : []);
      this.module = read.module;
      await this.make(maker, { name, read, breaks: false, mode: 'bend', asked });
    } catch (cause) {
      if (asked === this.runs) this.refuse(cause.message);
    }
  }

  async make(maker, { name, read, breaks, mode, asked }) {
    const begun = performance.now(), made = await this.ask(maker, { kind: 'make', options: breaks ? kBrittle : kSoft }, 'made');
    if (asked !== this.runs) return;
    this.say('Putting it into the picture');
    const file = open_page_file(made.page), bodies = await start_bodies(file);
    if (asked !== this.runs) return bodies.worker.terminate();
    this.page?.close();
    if (this.maker !== maker) this.maker?.terminate();
    this.maker = maker;
    this.maker_next = undefined;
    Object.assign(this, { name, read, breaks, file });
    element('title').textContent = name;
    element('failure').hidden = true;
    this.page = window.filigree = new BendPage(file, bodies, maker, () => this.show());
    this.page.times.make = { read: read.milliseconds, made: made.milliseconds, memory: made.memory, until: performance.now() - begun };
    this.page.fail = (message) => this.refuse(message);
    this.page.set_mode(mode);
    this.say('');
    this.show();
  }

  /// Asks a worker, and waits for an answer of a kind. Whoever else listens to the worker goes on.
  ask(worker, message, kind, moved = []) {
    return new Promise((resolve, reject) => {
      const end = new AbortController(), over = (action, value) => (end.abort(), action(value));
      worker.onerror = () => over(reject, new Error('This browser does not run the page (WebAssembly with SIMD); try a newer one.'));
      worker.addEventListener('message', ({ data }) => {
        if (data.kind === 'progress') this.phase(data);
        else if (data.kind === 'failed') over(reject, new Error(data.message));
        else if (data.kind === kind) over(resolve, data);
      }, { signal: end.signal });
      worker.postMessage(message, moved);
    });
  }

  async toggle_breaks() {
    if (!this.maker || this.maker_next || !element('loading').hidden) return;
    const asked = ++this.runs;
    this.say('Filling it with particles');
    try {
      await this.make(this.maker, { name: this.name, read: this.read, breaks: !this.breaks, mode: 'drop', asked });
    } catch (cause) {
      if (asked === this.runs) this.refuse(cause.message);
    }
  }

  // ---- saying

  say(text) {
    element('loading').hidden = text === '';
    element('loading-text').textContent = text;
  }
  phase({ phase, part }) {
    const words = kPhases.find(([pattern]) => pattern.test(phase))?.[1] ?? 'Working';
    this.say(part > 0 && part < 1 ? `${words}: ${Math.round(100 * part)} %` : words);
  }
  refuse(message) {
    this.say('');
    this.maker_next?.terminate();
    this.maker_next = undefined;
    show_failure(message);
  }

  /// What the page says of the body as it is.
  show() {
    const { page } = this, bent = page?.is_bent ?? true;
    element('actions').hidden = element('save').hidden = !page;
    element('mode-bend').setAttribute('aria-checked', bent);
    element('mode-drop').setAttribute('aria-checked', !bent);
    for (const one of document.querySelectorAll('.when-bent')) one.hidden = !bent;
    for (const one of document.querySelectorAll('.when-dropped')) one.hidden = bent;
    element('again').textContent = bent ? 'Straighten' : 'Drop again';
    element('breaks').setAttribute('aria-pressed', this.breaks);
    element('error').setAttribute('aria-pressed', page?.shows_error ?? false);
    if (!page) return;
    element('facts-line').textContent = `${count(page.live.driver_vertices)} points move, ${count(page.live.vertices)} follow`;
    element('hint').hidden = page.was_touched;
    element('hint').textContent = bent ? 'Drag it: it bends' : 'Drag it: it can be pulled';
    const error = bent && page.shows_error ? page.error : undefined;
    element('legend').hidden = !error;
    if (!error) return;
    element('error-text').textContent = `Off by ${percent(error.mean)} of its size on average, ${percent(error.most)} at most, from bending all ${count(page.live.vertices)} points.`;
    element('ramp-end').textContent = `${percent(error.end)} and more`;
  }

  // ---- doing

  save() {
    const bytes = this.file.part(this.file.head.models[0]);
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([bytes], { type: 'application/octet-stream' }));
    link.download = `${this.name.replace(/\.[^.]*$/, '')}.fil`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60e3);
  }

  listen() {
    const on = (id, action) => element(id).addEventListener('click', action);
    on('open', () => element('file').click());
    element('file').addEventListener('change', ({ target }) => {
      const [file] = target.files;
      target.value = ''; // so that the same file can be chosen again
      if (file) this.take({ file });
    });
    on('mode-bend', () => this.page?.set_mode('bend'));
    on('mode-drop', () => this.page?.set_mode('drop'));
    on('error', () => this.page?.show_error(!this.page.shows_error));
    on('breaks', () => this.toggle_breaks());
    on('save', () => this.save());
    on('failure-close', () => { element('failure').hidden = true; });
    let inside = 0;
    addEventListener('dragenter', (event) => {
      event.preventDefault();
      if (++inside === 1) element('target').hidden = false;
    });
    addEventListener('dragleave', () => { if (--inside <= 0) element('target').hidden = true; });
    addEventListener('dragover', (event) => event.preventDefault());
    addEventListener('drop', (event) => {
      event.preventDefault();
      inside = 0;
      element('target').hidden = true;
      const [file] = event.dataTransfer.files;
      if (file) this.take({ file });
    });
    addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || element('help').open) return;
      const action = {
        b: () => this.page?.set_mode('bend'),
        d: () => this.page?.set_mode('drop'),
        e: () => this.page?.is_bent && this.page.show_error(!this.page.shows_error),
        k: () => this.page && !this.page.is_bent && this.toggle_breaks(),
      }[event.key.toLowerCase()];
      action?.();
    });
  }
}

window.site = new Site();
