// The page: what is selected, pointed at, taken apart; and the switches of its pictures. Names are set as text, never as markup.
'use strict';

(() => {
  const $ = (id) => document.getElementById(id), all = (query, from = document) => [...from.querySelectorAll(query)];
  const data = JSON.parse($('data').textContent), canvas = $('canvas');
  const root = document.documentElement, dark = matchMedia('(prefers-color-scheme: dark)');

  // Light and dark: as the system has it until someone decides.
  const toggle = document.createElement('button');
  const theme = (name) => {
    root.dataset.theme = name;
    toggle.textContent = name === 'dark' ? 'Light' : 'Dark';
    toggle.setAttribute('aria-label', `Change to ${name === 'dark' ? 'light' : 'dark'} colours`);
  };
  let chosen = false;
  toggle.type = 'button';
  toggle.onclick = () => { chosen = true; theme(root.dataset.theme === 'dark' ? 'light' : 'dark'); };
  dark.addEventListener('change', () => chosen || theme(dark.matches ? 'dark' : 'light'));
  document.querySelector('nav').append(toggle);
  theme(dark.matches ? 'dark' : 'light');

  // Pictures: layers of the view, drawings one at a time, verdicts over photos.
  for (const box of all('[data-layer]')) {
    const figure = box.closest('.layers');
    box.onchange = () => { figure.dataset.show = all('[data-layer]', figure).filter((b) => b.checked).map((b) => b.dataset.layer).join(' '); };
  }
  const sheets = $('sheets');
  if (sheets) sheets.onchange = () => all('[data-sheet]').forEach((s) => { s.hidden = s.dataset.sheet !== sheets.value; });
  const overlays = $('overlays');
  if (overlays) overlays.onchange = () => $('photos').classList.toggle('plain', !overlays.checked);

  if (!canvas || !data.components || !data.components.length) return;

  const viewer = new Viewer(canvas, data), { parts } = viewer;
  const state = { selected: null, over: null, apart: 0, step: null, lift: 0 };
  const reduced = matchMedia('(prefers-reduced-motion: reduce)');
  const id = (at) => parts[at.component].first + at.face;
  const nameOf = (at) => `${parts[at.component].name}.${parts[at.component].mesh.names[at.face][0]}`;

  // --- Contacts -----------------------------------------------------------------------------------------------------
  const touches = parts.map(() => []);
  for (const contact of data.contacts) {
    const [a, b] = [contact.a, contact.b].map(([component, face]) => ({ component, face }));
    touches[a.component].push({ own: a, other: b, contact });
    touches[b.component].push({ own: b, other: a, contact });
  }
  const contactsOf = (at) => touches[at.component].filter((t) => at.face === null || t.own.face === at.face);

  // --- Colours ------------------------------------------------------------------------------------------------------
  const hex = (text) => [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16));
  const mix = (a, b, t) => a.map((v, k) => v + (b[k] - v) * t);
  const SELECTED = [255, 140, 46], PARTNER = [64, 156, 255], RISK = [[75, 155, 122], [228, 182, 64], [200, 69, 47]], UNKNOWN = [150, 155, 163];
  const risk = (r) => (r === null ? UNKNOWN : r < 0.5 ? mix(RISK[0], RISK[1], 2 * r) : mix(RISK[1], RISK[2], 2 * r - 1));
  const paints = {
    component: (p) => hex(p.colour),
    material: (p) => hex(parts.find((q) => q.material === p.material).colour),
    risk: (p) => risk(p.risk),
  };

  function colour() {
    const { selected, over } = state, paint = paints[$('colours').value];
    const through = selected && $('through').checked;
    for (const p of parts) {
      const base = paint(p), end = p.first + p.mesh.names.length;
      const own = selected && selected.component === p.index, lit = over && over.component === p.index;
      const tint = lit && !own ? mix(base, [255, 255, 255], 0.35) : base;
      for (let f = p.first; f < end; f++) { viewer.tints.set(tint, 3 * f); viewer.thin[f] = through && !own ? 1 : 0; }
    }
    if (selected) {
      for (const t of contactsOf(selected)) { viewer.tints.set(PARTNER, 3 * id(t.other)); viewer.thin[id(t.other)] = 0; }
      if (selected.face !== null) viewer.tints.set(SELECTED, 3 * id(selected));
      else for (const t of contactsOf(selected)) viewer.tints.set(mix(paint(parts[selected.component]), SELECTED, 0.55), 3 * id(t.own));
    }
    if (over && over.face !== null) {
      const at = 3 * id(over);
      viewer.tints.set(mix([...viewer.tints.slice(at, at + 3)], [255, 255, 255], 0.45), at);
      viewer.thin[id(over)] = 0;
    }
  }

  // --- Where things stand -------------------------------------------------------------------------------------------
  function arrange() {
    for (const p of parts) {
      let by = state.apart;
      viewer.shown[p.index] = state.step === null || p.step <= state.step;
      if (state.step !== null) by = p.step === state.step ? state.lift : 0;
      viewer.moves[p.index] = p.offset.map((v) => v * by);
    }
    viewer.spread = state.step === null ? state.apart : state.lift;
  }
  function show(raster = true) { arrange(); colour(); viewer.ask(raster); }

  let settling = 0;
  function move() {
    viewer.moving = true;
    show();
    clearTimeout(settling);
    settling = setTimeout(() => { viewer.moving = false; show(); }, 160);
  }

  function glide(change, done) {
    if (reduced.matches) { change(1); show(); if (done) done(); return; }
    const start = performance.now();
    const tick = (now) => {
      const t = Math.min(1, (now - start) / 450), eased = t * t * (3 - 2 * t);
      change(eased); move();
      if (t < 1) requestAnimationFrame(tick); else if (done) done();
    };
    requestAnimationFrame(tick);
  }

  // --- What is selected ---------------------------------------------------------------------------------------------
  const about = $('about'), hint = [...about.childNodes];
  const element = (tag, content, name) => {
    const made = document.createElement(tag);
    if (name) made.className = name;
    made.append(...(Array.isArray(content) ? content : [content]));
    return made;
  };

  // A path that may break after its dots.
  const path = (text) => text.split(/(?<=\.)/).flatMap((piece, i) => (i ? [document.createElement('wbr'), piece] : [piece]));

  function describe() {
    const { selected } = state;
    if (!selected) { about.replaceChildren(...hint); return; }
    const part = parts[selected.component], found = contactsOf(selected), lines = element('dl', []);
    const line = (term, text) => lines.append(element('dt', term), element('dd', text));
    about.replaceChildren(element('h3', selected.face === null ? part.name : path(nameOf(selected))), lines);
    line('Component', part.name);
    line('Part', part.part);
    line('Material', part.material);
    if (selected.face !== null) {
      const [, surface, area] = part.mesh.names[selected.face];
      line('Surface', surface);
      line('Area', area);
    } else line('Faces', String(part.mesh.names.length));
    if (part.risk !== null) line('Escapes', `≤ ${(100 * part.risk).toFixed(1)} % (worst fault, 95 %)`);
    const faces = (n) => (n === 1 ? 'one face' : `${n} faces`);
    about.append(element('h4', found.length ? `Touches ${faces(found.length)}` : 'Touches nothing'));
    for (const t of found) about.append(row(t, selected.face === null));
    // What the rest of the component touches.
    const rest = selected.face === null ? [] : touches[selected.component].filter((t) => t.own.face !== selected.face);
    if (rest.length) about.append(element('h4', `Elsewhere ${part.name} touches ${faces(rest.length)}`), ...rest.map((t) => row(t, true)));
  }

  function row({ own, other, contact }, both) {
    const { kind, fit, area, gap, play } = contact;
    const facts = [kind, area === '0' ? '' : `${area} mm²`].filter(Boolean).join(', ');
    const button = element('button', [element('b', path(nameOf(other))), ' '], 'touch');
    button.type = 'button';
    if (fit) button.append(element('span', fit, `fit ${fit}`));
    if (both) button.append(element('small', `by ${parts[own.component].mesh.names[own.face][0]}`));
    button.append(element('small', facts), element('small', `gap ${gap[0]} … ${gap[1]} mm (MMC … LMC), with placement ${play[0]} … ${play[1]} mm`));
    button.onclick = () => select(other);
    button.onmouseenter = button.onfocus = () => point(other);
    button.onmouseleave = button.onblur = () => point(null);
    return button;
  }

  function select(at) {
    state.selected = at;
    for (const b of all('.parts button')) b.setAttribute('aria-pressed', String(!!at && Number(b.dataset.c) === at.component));
    describe();
    canvas.dataset.selected = at ? (at.face === null ? parts[at.component].name : nameOf(at)) : '';
    show();
  }

  // Points at a component or face everywhere on the page.
  function point(at) {
    const same = (a, b) => a === b || (a && b && a.component === b.component && a.face === b.face);
    if (same(at, state.over)) return;
    const through = state.selected && $('through').checked;
    state.over = at;
    for (const e of all('[data-c]')) e.classList.toggle('on', !!at && Number(e.dataset.c) === at.component);
    show(!!through);
  }

  function pointable(e) {
    const at = { component: Number(e.dataset.c), face: null };
    e.addEventListener('mouseenter', () => point(at));
    e.addEventListener('mouseleave', () => point(null));
    if (e.tagName === 'BUTTON') {
      e.onfocus = () => point(at);
      e.onblur = () => point(null);
      e.onclick = () => select(state.selected && state.selected.component === at.component && state.selected.face === null ? null : at);
    }
  }
  all('[data-c]').forEach(pointable);

  // Names in the drawings point at what they name.
  const byName = new Map();
  for (const p of parts) {
    byName.set(p.name, { component: p.index, face: null });
    p.mesh.names.forEach(([face], f) => byName.set(`${p.name}.${face}`, { component: p.index, face: f }));
  }
  for (const sheet of all('.sheet')) {
    sheet.addEventListener('mouseover', (event) => {
      let found = null;
      for (let e = event.target; e && e !== sheet && !found; e = e.parentNode) {
        const title = e.querySelector && e.querySelector(':scope > title');
        found = (title && byName.get(title.textContent)) || (e.tagName === 'text' && byName.get(e.textContent)) || null;
      }
      point(found);
    });
    sheet.addEventListener('mouseleave', () => point(null));
  }

  // --- Turning, zooming, clicking -----------------------------------------------------------------------------------
  const pointers = new Map(), tip = $('tip');
  let travelled = 0, spread = 0;
  const place = (event) => { const box = canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
  const zoom = (by) => { viewer.zoom = Math.min(40, Math.max(0.3, viewer.zoom * by)); move(); };
  const rotate = (dx, dy) => {
    viewer.turn.azimuth -= dx * 0.008;
    viewer.turn.elevation = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, viewer.turn.elevation + dy * 0.008));
    move();
  };
  const pan = (dx, dy) => {
    const box = canvas.getBoundingClientRect();
    viewer.pan = [viewer.pan[0] + dx / box.width, viewer.pan[1] + dy / box.height];
    move();
  };

  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, place(event));
    if (pointers.size === 1) travelled = 0;
    spread = 0;
    tip.hidden = true;
  });
  canvas.addEventListener('pointermove', (event) => {
    const at = place(event), before = pointers.get(event.pointerId);
    if (!before) return hover(at);
    const [dx, dy] = [at[0] - before[0], at[1] - before[1]];
    pointers.set(event.pointerId, at);
    travelled += Math.hypot(dx, dy);
    if (travelled < 4) return;
    if (pointers.size === 2) {
      const [a, b] = [...pointers.values()], apart = Math.hypot(a[0] - b[0], a[1] - b[1]);
      if (spread) zoom(apart / spread);
      spread = apart;
      pan(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons & 6) pan(dx, dy);
    else rotate(dx, dy);
  });
  const released = (event) => {
    const own = pointers.delete(event.pointerId);
    if (own && event.type === 'pointerup' && travelled < 4 && event.button === 0) select(viewer.pick(...place(event)));
  };
  canvas.addEventListener('pointerup', released);
  canvas.addEventListener('pointercancel', released);
  canvas.addEventListener('pointerleave', () => { tip.hidden = true; point(null); });
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  // The wheel scrolls the page until the canvas was clicked.
  canvas.addEventListener('wheel', (event) => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    zoom(Math.exp(-event.deltaY * 0.0015));
  }, { passive: false });
  canvas.addEventListener('keydown', (event) => {
    const keys = {
      ArrowLeft: () => rotate(-20, 0), ArrowRight: () => rotate(20, 0), ArrowUp: () => rotate(0, -20), ArrowDown: () => rotate(0, 20),
      '+': () => zoom(1.2), '=': () => zoom(1.2), '-': () => zoom(1 / 1.2), Escape: () => select(null), Home: () => look('iso'),
    };
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
  });

  function hover([x, y]) {
    if (viewer.moving) return;
    const at = viewer.pick(x, y);
    tip.hidden = !at;
    if (at) {
      tip.textContent = nameOf(at);
      tip.style.left = `${Math.max(4, Math.min(x + 14, canvas.clientWidth - tip.offsetWidth - 4))}px`;
      tip.style.top = `${Math.max(4, y - 34)}px`;
    }
    point(at);
  }

  // --- Controls -----------------------------------------------------------------------------------------------------
  const half = Math.PI / 2;
  const views = { iso: [-0.9, 0.55], front: [-half, 0], right: [0, 0], top: [-half, half] };
  if (data.camera) {
    const [x, y, z] = data.camera;
    views.camera = [Math.hypot(x, y) > 1e-6 ? Math.atan2(y, x) : -half, Math.asin(Math.max(-1, Math.min(1, z)))];
    all('[data-view="camera"]').forEach((b) => { b.hidden = false; });
  }
  function look(name) {
    const from = { ...viewer.turn }, [azimuth, elevation] = views[name], zoomed = viewer.zoom, panned = viewer.pan;
    const around = Math.atan2(Math.sin(azimuth - from.azimuth), Math.cos(azimuth - from.azimuth));
    glide((t) => {
      viewer.turn = { azimuth: from.azimuth + around * t, elevation: from.elevation + (elevation - from.elevation) * t };
      viewer.zoom = zoomed + (1 - zoomed) * t;
      viewer.pan = panned.map((p) => p * (1 - t));
    });
  }
  all('[data-view]').forEach((b) => { b.onclick = () => look(b.dataset.view); });
  all('[data-zoom]').forEach((b) => { b.onclick = () => zoom(Number(b.dataset.zoom)); });

  const slider = $('explode');
  const steps = all('[data-step]');
  function stepTo(step) {
    state.step = step;
    steps.forEach((b) => b.setAttribute('aria-pressed', String(step !== null && Number(b.dataset.step) === step)));
  }
  slider.oninput = () => { stepTo(null); state.apart = slider.value / 100; move(); };
  for (const b of steps) {
    b.onclick = () => {
      const step = Number(b.dataset.step);
      if (state.step === step) { stepTo(null); state.apart = slider.value / 100; show(); return; }
      stepTo(step);
      glide((t) => { state.lift = 1 - t; });
    };
  }
  $('through').onchange = () => show();
  $('colours').onchange = () => { $('legend').hidden = $('colours').value !== 'risk'; show(false); };
  if (parts.some((p) => p.risk !== null)) all('#colours [value="risk"]').forEach((o) => { o.hidden = false; });
  new ResizeObserver(() => show()).observe(canvas);
  show();

  // For tests and for the curious: the same as a pointer would find.
  window.gonogo = { viewer, select, pointable, find: (name) => { const at = byName.get(name); return at && at.face !== null ? viewer.where(at.component, at.face) : null; } };
})();
