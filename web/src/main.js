// The page: a model, its stage, and the controls around it.
import { make_driver } from './driver.js';
import { count_text, facts_of, size_text, sizes_of } from './facts.js';
import { load_bytes, Model } from './model.js';
import { Stage } from './stage.js';
import { StreamModel } from './stream_model.js';
import { Wireframe } from './wireframe.js';

const element = (id) => document.getElementById(id);
const is_narrow = () => innerWidth <= 640;

class Page {
  constructor(model) {
    this.model = model;
    this.stage = new Stage(element('picture'), model, () => this.draw());
    this.driver = make_driver(model, 2 * this.stage.radius);
    if (this.driver) {
      this.driver.object.visible = false;
      this.stage.scene.add(this.driver.object);
    }
    this.wireframe = new Wireframe(model);
    this.time = 0;
    this.speed = 1;
    this.loops = true;
    this.is_playing = false;

    this.fill_levels();
    this.fill_clips();
    this.fill_facts();
    this.set_dark(matchMedia('(prefers-color-scheme: dark)').matches);
    this.listen();
    element('buttons').hidden = element('panel').hidden = false;
    element('panel').open = new URLSearchParams(location.search).has('details');
    element('timeline').hidden = !model.action;
    this.resize();
    this.show_level(0);
    this.seek(0);
    if (model.action && !matchMedia('(prefers-reduced-motion: reduce)').matches) this.toggle_play();
  }

  // ---- a model that comes level by level

  receive() {
    return Promise.all([this.receive_levels(), this.model.materials.read_pictures(() => this.draw())]);
  }

  /// Takes levels as they come, but none that would not be seen; goes on when the view comes nearer.
  async receive_levels() {
    const { model } = this;
    while (!model.is_whole) {
      if (model.chooses && !this.choose_near())
        await new Promise((resolve) => { this.wake = resolve; });
      else {
        await model.next_level();
        this.fill_levels();
        this.fill_facts();
        if (model.chooses) this.choose_near();
        else this.show_level(model.level);
        this.draw();
      }
      await new Promise((resolve) => { setTimeout(resolve); }); // a picture between two levels
    }
  }

  /// Draws fine triangles where they are near. Returns whether a level that has not come would be seen.
  choose_near() {
    const { model } = this, { changed, wants_more, is_soon } = model.choose_near(this.stage.camera, this.stage.height);
    if (wants_more) this.wake?.();
    if (is_soon) this.later ??= setTimeout(() => { this.later = undefined; this.draw(); }, 100);
    if (!changed) return wants_more;
    this.wireframe.follow_level();
    this.mark_level();
    element('level-note').textContent = `${count_text(model.near_triangles)} triangles, ${count_text(model.levels[0].triangles)} in the finest level`;
    return wants_more;
  }

  // ---- drawing

  /// Soon, once for all that changes until then.
  draw() { this.request ??= requestAnimationFrame((now) => this.draw_now(now)); }

  draw_now(now) {
    this.request = undefined;
    if (this.is_playing) {
      const passed = Math.min((now - (this.last_drawn ?? now)) / 1000, 0.25); // a page in the background does not jump
      this.advance(passed * this.speed);
    }
    this.last_drawn = now;
    if (this.model.chooses) this.choose_near();
    if (this.stage.draw() || this.is_playing) this.draw();
  }

  advance(seconds) {
    const { duration } = this.model;
    let time = this.time + seconds;
    if (time >= duration) {
      if (!this.loops) this.toggle_play();
      time = this.loops && duration > 0 ? time % duration : duration;
    }
    this.seek(time);
  }

  resize() {
    const panel = element('panel'), timeline = element('timeline');
    const covered = panel.hidden || !panel.open ? 0 : panel.offsetWidth + 16;
    const bottom = timeline.hidden ? 0 : timeline.offsetHeight + 18;
    const top = document.querySelector('header').offsetHeight;
    if (is_narrow()) this.stage.resize(innerWidth, innerHeight, 0, bottom + panel.offsetHeight + 12, top);
    else this.stage.resize(innerWidth, innerHeight, covered, bottom, top);
    this.draw();
  }

  set_dark(dark) {
    this.is_dark = dark;
    document.documentElement.dataset.theme = dark ? 'dark' : 'light';
    this.stage.set_dark(dark);
    this.driver?.color(dark ? 0x8fbcff : 0x1b5cc4);
    this.wireframe.set_dark(dark);
    this.draw();
  }

  // ---- time

  seek(seconds) {
    const { model } = this;
    this.time = Math.min(Math.max(seconds, 0), model.duration);
    const before = model.shown_counts;
    model.seek(this.time);
    if (model.shown_counts !== before) this.fill_facts(); // another key frame
    if (this.driver?.object.visible) this.driver.follow();
    element('scrub').value = this.time;
    element('scrub').style.setProperty('--played', `${(100 * this.time) / (model.duration || 1)}%`);
    element('moment').innerHTML = `${this.time.toFixed(2)} <small>/ ${model.duration.toFixed(2)} s</small>`;
    this.draw();
  }

  toggle_play() {
    if (!this.model.action) return;
    if (!this.is_playing && this.time >= this.model.duration) this.seek(0);
    this.is_playing = !this.is_playing;
    this.last_drawn = undefined;
    element('play').classList.toggle('playing', this.is_playing);
    element('play').setAttribute('aria-label', this.is_playing ? 'Pause' : 'Play');
    this.draw();
  }

  /// To the next key in a direction, 1 or -1.
  step(direction) {
    if (this.is_playing) this.toggle_play();
    const slack = 1e-4, times = Array.from(this.model.times);
    const next = direction > 0 ? times.find((time) => time > this.time + slack)
      : times.findLast((time) => time < this.time - slack);
    if (next !== undefined) this.seek(next);
  }

  toggle_loop() {
    this.loops = !this.loops;
    element('loop').setAttribute('aria-pressed', this.loops);
  }

  // ---- what is shown

  /// number: as in the file, 0 the finest.
  show_level(number) {
    if (number < 0 || number >= this.model.levels.length) return;
    const { levels } = this.model;
    this.model.show_level(number);
    this.wireframe.follow_level();
    const { vertices, triangles } = levels[number];
    this.mark_level();
    const counts = `${count_text(vertices)} vertices, ${count_text(triangles)} triangles`;
    element('level-note').textContent = number === levels.length - 1 && number > 0 && !this.model.is_stream ? `The driver: ${counts}` : counts;
    this.draw();
  }

  /// The button of what is shown.
  mark_level() {
    for (const button of element('levels').children) {
      const chosen = button.dataset.level === undefined ? this.model.chooses
        : !this.model.chooses && Number(button.dataset.level) === this.model.level;
      button.setAttribute('aria-checked', chosen);
      button.tabIndex = chosen ? 0 : -1;
    }
  }

  /// The user's choice.
  pick_level(number) {
    if (number < 0 || number >= this.model.levels.length) return;
    this.model.chooses = false;
    this.wake?.();
    this.show_level(number);
  }

  choose_again() {
    this.model.chooses = true;
    this.choose_near();
    this.draw();
  }

  show_driver(shown) {
    if (!this.driver) return;
    element('driver').checked = this.driver.object.visible = shown;
    if (shown) this.driver.follow();
    this.draw();
  }

  show_wireframe(shown) {
    element('wireframe').checked = shown;
    this.wireframe.show(shown);
    this.draw();
  }

  // ---- the panel

  fill_levels() {
    const { levels } = this.model;
    element('levels-section').hidden = levels.length < 2;
    element('levels').replaceChildren();
    if (this.model.is_stream) {
      const button = text_in('button', 'Auto');
      button.title = 'Fine where it is near, so that errors are smaller than a pixel';
      button.setAttribute('role', 'radio');
      button.onclick = () => this.choose_again();
      element('levels').append(button);
    }
    for (let number = levels.length - 1; number >= 0; --number) {
      const button = document.createElement('button');
      button.textContent = levels.length - 1 - number;
      button.dataset.level = number;
      button.title = `${count_text(levels[number].triangles)} triangles`;
      button.setAttribute('role', 'radio');
      button.onclick = () => this.pick_level(number);
      element('levels').append(button);
    }
    element('driver').disabled = !this.driver;
    element('driver-label').hidden = this.model.key_frames?.length > 0; // a film whose faces change has none
    if (!this.driver) element('driver-label').title = 'This file has one level and no joints';
  }

  fill_clips() {
    const { clips } = this.model;
    element('clips-section').hidden = clips.length < 2;
    clips.forEach((clip, i) => element('clips').add(new Option(clip.name || `Animation ${i + 1}`, i)));
    element('scrub').max = this.model.duration;
  }

  fill_facts() {
    const sizes = sizes_of(this.model), largest = Math.max(...sizes.map(({ bytes }) => bytes));
    element('sizes').replaceChildren(...sizes.map(({ name, bytes }) => {
      const bar = document.createElement('div');
      bar.className = 'bar';
      bar.append(text_in('span', name), text_in('b', size_text(bytes)), document.createElement('i'));
      bar.lastChild.style.setProperty('--share', `${(100 * bytes) / largest}%`);
      return bar;
    }));
    element('sizes-section').hidden = sizes.length < 2;
    const ratio = sizes.length > 1 ? sizes[1].bytes / sizes[0].bytes : 0;
    element('sizes-note').textContent = ratio >= 1.05
      ? `${ratio >= 10 ? Math.round(ratio) : ratio.toFixed(1)} times smaller than every vertex at every key`
      : '';
    element('facts').replaceChildren(...facts_of(this.model).flatMap(([name, value]) => [text_in('dt', name), text_in('dd', value)]));
    const { is_stream, is_whole, bytes, bytes_read } = this.model;
    const size = is_stream && !is_whole ? `${size_text(bytes_read)} of ${size_text(bytes)}` : size_text(bytes);
    element('summary').textContent = `${count_text((this.model.shown_counts ?? this.model.levels[0]).triangles)} triangles, ${size}`;
  }

  choose_clip(number) {
    this.model.play(number);
    element('scrub').max = this.model.duration;
    this.fill_facts();
    this.seek(0);
  }

  // ---- what the user does

  listen() {
    const on = (id, event, action) => element(id).addEventListener(event, action);
    on('play', 'click', () => this.toggle_play());
    on('loop', 'click', () => this.toggle_loop());
    on('scrub', 'input', () => {
      if (this.is_playing) this.toggle_play();
      this.seek(Number(element('scrub').value));
    });
    on('speed', 'change', () => { this.speed = Number(element('speed').value); });
    on('clips', 'change', () => this.choose_clip(Number(element('clips').value)));
    on('driver', 'change', () => this.show_driver(element('driver').checked));
    on('wireframe', 'change', () => this.show_wireframe(element('wireframe').checked));
    on('theme', 'click', () => this.set_dark(!this.is_dark));
    on('help-button', 'click', () => element('help').showModal());
    on('panel', 'toggle', () => this.resize());
    on('picture', 'dblclick', () => { this.stage.frame(); this.draw(); });
    addEventListener('resize', () => this.resize());
    addEventListener('keydown', (event) => this.press(event));
  }

  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || element('help').open) return;
    const on_control = event.target.closest('select, summary, button');
    if (event.target.closest('select') || (on_control && [' ', 'Enter'].includes(event.key))) return;
    const { levels } = this.model;
    const keys = {
      ' ': () => this.toggle_play(),
      ArrowLeft: () => this.step(-1),
      ArrowRight: () => this.step(1),
      ArrowUp: () => this.pick_level(this.model.level - 1),
      ArrowDown: () => this.pick_level(this.model.level + 1),
      d: () => this.show_driver(!element('driver').checked),
      w: () => this.show_wireframe(!element('wireframe').checked),
      l: () => this.toggle_loop(),
      f: () => { this.stage.frame(); this.draw(); },
      t: () => this.set_dark(!this.is_dark),
      h: () => element('help').showModal(),
      '?': () => element('help').showModal(),
    };
    const action = /^[0-9]$/.test(event.key) ? () => this.pick_level(levels.length - 1 - Number(event.key))
      : keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }
}

function text_in(name, text) {
  const made = document.createElement(name);
  made.textContent = text;
  return made;
}

/// What has come of the model, while there is only its poster to see.
function tell_loaded(bytes) {
  const all = Number(document.documentElement.dataset.bytes);
  element('loading-text').textContent = `Loading the model: ${Math.min(Math.floor((100 * bytes) / all), 100)} % of ${size_text(all)}`;
}

function end_loading() {
  element('loading')?.remove();
  const poster = element('poster');
  if (!poster) return;
  poster.classList.add('gone');
  setTimeout(() => poster.remove(), 400);
}

async function open() {
  try {
    const is_stream = document.documentElement.dataset.model === 'stream';
    const model = is_stream ? await StreamModel.load() : await Model.load(await load_bytes(tell_loaded));
    window.filigree = new Page(model);
    end_loading();
    if (is_stream) await window.filigree.receive();
  } catch (cause) {
    document.documentElement.dataset.theme = matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light';
    element('failure').hidden = false;
    element('failure-cause').textContent = /WebGL/.test(cause.message)
      ? 'This browser does not draw in three dimensions (WebGL 2); try another one, or allow it in the settings.'
      : cause.message;
    end_loading();
  }
}

open();
