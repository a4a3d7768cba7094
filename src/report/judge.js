
// Judging photos in the page. The module is compiled when the first photo comes. Names are set as text, never as markup.
{
  const $ = (id) => document.getElementById(id);
  const GAP = 3, MOST_BOXES = 6, LARGEST = 1280, STRIP = { width: 300, middle: 15 };
  const WORDS = { go: ['go', 'go'], 'no-go': ['nogo', 'no-go'], 'cannot-inspect': ['cannot', 'cannot inspect'] };

  const make = (tag, attributes = {}, ...content) => {
    const made = tag.startsWith('svg:') ? document.createElementNS('http://www.w3.org/2000/svg', tag.slice(4)) : document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...content);
    return made;
  };
  const number = (value, decimals) => (value === null ? '–' : String(Number(value.toFixed(decimals))).replace('-', '−'));
  const say = (text, bad = false) => { $('judge-status').textContent = text; $('judge-status').classList.toggle('doubt', bad); };

  // --- The inspector --------------------------------------------------------------------------------------------------
  function bytesOf(id) {
    const block = $(id);
    if (!block) return null;
    const text = atob(block.textContent), bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
    return bytes;
  }
  let opened = null;
  async function inspector() {
    const gonogo = await load(bytesOf('judge-module'));
    return gonogo.open(bytesOf('judge-model'), bytesOf('judge-calibration'));
  }

  // --- What is shown --------------------------------------------------------------------------------------------------
  // As in the photos of the report: corners moved towards the centre, but never past it.
  function shrunk(corners, by) {
    const centre = [0, 1].map((k) => corners.reduce((sum, c) => sum + c[k], 0) / 4);
    return corners.map((corner) => {
      const arm = corner.map((v, k) => v - centre[k]), reach = Math.min(Math.abs(arm[0]), Math.abs(arm[1]));
      const share = reach > Math.abs(by) ? 1 - by / reach : 0.2;
      return arm.map((v, k) => centre[k] + v * share);
    });
  }
  const quad = (corners, name) => make('svg:polygon', { points: corners.map((p) => p.map((v) => v.toFixed(1)).join()).join(' '), ...(name && { class: name }) });

  function node(report, row) {
    const kind = !report.faulty ? 'good' : report.explained ? 'explained' : 'faulty';
    const group = make('svg:g', { class: kind }, make('svg:title', {}, report.faulty ? `${report.node}: ${report.fault}` : report.node));
    for (let ring = 0; ring <= Math.min(report.level, MOST_BOXES); ring++) group.append(quad(shrunk(report.outline, GAP * ring)));
    if (report.faulty) {
      const [a, b, c, d] = report.crossed.map((p) => p.join(' '));
      group.append(make('svg:path', { d: `M${a}L${c}M${b}L${d}` }));
    }
    if (row && row.dataset.component) {
      group.dataset.c = row.dataset.component;
      if (window.gonogo.pointable) window.gonogo.pointable(group);
    }
    return group;
  }

  // The grey values that were judged, not what the browser makes of the file.
  function picture(grey, width, height) {
    const whole = make('canvas', { width, height }), image = new ImageData(width, height);
    for (let i = 0; i < grey.length; i++) image.data.set([grey[i], grey[i], grey[i], 255], 4 * i);
    whole.getContext('2d').putImageData(image, 0, 0);
    const by = Math.max(1, Math.ceil(Math.max(width, height) / LARGEST));
    if (by === 1) return whole.toDataURL();
    const small = make('canvas', { width: Math.floor(width / by), height: Math.floor(height / by) });
    small.getContext('2d').drawImage(whole, 0, 0, small.width, small.height);
    return small.toDataURL();
  }

  function figure(verdict, grey, { width, height }, rows) {
    const drawn = make('svg:g', { class: 'drawn' });
    if (verdict.outline) drawn.append(quad(shrunk(verdict.outline, -GAP), 'whole'));
    verdict.nodes.forEach((report, i) => { if (report.outline.flat().every((v) => v !== null)) drawn.append(node(report, rows[i])); });
    const image = make('svg:image', { href: picture(grey, width, height), width, height });
    const label = `${verdict.photo}: ${WORDS[verdict.verdict][1]}`;
    return make('figure', { class: 'overlay' }, make('svg:svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': label }, image, drawn));
  }

  function mark(row, report, name) {
    const [low, high] = [row.dataset.low, row.dataset.high].map(Number), { width, middle } = STRIP;
    row.classList.toggle('faulty', report.faulty);
    row.lastElementChild.textContent = number(report.score, 3);
    const strip = row.querySelector('svg');
    if (!strip || row.dataset.low === '' || report.score === null) return;
    const x = Math.min(width - 1, Math.max(1, ((report.score - low) / (high - low)) * width));
    const shape = report.score < low ? `M1 ${middle}l8 -5v10z` : report.score > high ? `M${width - 1} ${middle}l-8 -5v10z` : `M${x.toFixed(1)} ${middle - 5}l4.5 5 -4.5 5 -4.5 -5z`;
    strip.append(make('svg:path', { class: `mark ${report.faulty ? 'nogo' : 'go'}`, d: shape }, make('svg:title', {}, `${name}: ${number(report.score, 3)}`)));
  }

  function card(verdict, grey, size, milliseconds) {
    const [kind, word] = WORDS[verdict.verdict], about = make('div');
    const scores = $('judge-scores').content.cloneNode(true), rows = [...scores.querySelectorAll('tr')];
    if (verdict.verdict === 'cannot-inspect') about.append(make('p', {}, verdict.reason));
    const finding = ({ component, fault, p_value }) => {
      const chance = p_value === null ? '–' : `at most ${number(Math.ceil(1000 * p_value) / 10, 1)} %`;
      return make('li', {}, make('b', {}, component), `: ${fault} `, make('small', {}, `(${chance} of correct assemblies look as bad)`));
    };
    if (verdict.findings.length) about.append(make('ul', { class: 'list' }, ...verdict.findings.map(finding)));
    const place = ({ x, y, rotation_deg }) => `Found at (${number(x, 2)}, ${number(y, 2)}) mm, turned ${number(rotation_deg, 2)}°, locator's score ${number(verdict.locator_score, 2)}. `;
    about.append(make('p', { class: 'num' }, `${verdict.pose ? place(verdict.pose) : ''}Judged in ${number(milliseconds, 0)} ms.`));
    verdict.nodes.forEach((report, i) => { if (rows[i]) mark(rows[i], report, verdict.photo); });
    if (verdict.nodes.length) about.append(scores);
    const seen = verdict.decoded ? figure(verdict, grey, size, rows) : make('p', { class: 'nopicture' }, 'No picture could be read.');
    return make('article', { class: 'photo' }, make('h3', {}, make('span', { class: `verdict ${kind}` }, word), verdict.photo), make('div', { class: 'pair' }, seen, about));
  }

  // --- Photos come ----------------------------------------------------------------------------------------------------
  // The lines of JSON, newest last: for tests and for the curious.
  const lines = [];
  const pause = () => new Promise((done) => { setTimeout(done, 20); });

  async function judge(file) {
    say(opened ? `Judging ${file.name} …` : `Opening the model, then judging ${file.name} …`);
    await pause();
    try {
      const photo = new Uint8Array(await file.arrayBuffer());
      opened ??= await inspector();
      const start = performance.now(), { text, grey } = opened.show(file.name, photo);
      const milliseconds = performance.now() - start;
      $('judge-photos').prepend(card(JSON.parse(text), grey, opened, milliseconds));
      lines.push(text);
      say(`Judged: ${lines.length}.`);
    } catch (error) {
      // After a fault of the module nothing in it can be relied on: the next photo gets a new one.
      if (error instanceof WebAssembly.RuntimeError) opened = null;
      say(`${file.name}: ${error.message}`, true);
    }
  }

  let last = Promise.resolve();
  const add = (files) => { for (const file of files) last = last.then(() => judge(file)); };
  const files = $('judge-files'), drop = $('judge-drop');
  files.onchange = () => { add([...files.files]); files.value = ''; };
  const carries = (event) => event.dataTransfer && [...event.dataTransfer.types].includes('Files');
  document.addEventListener('dragover', (event) => {
    if (!carries(event)) return;
    event.preventDefault();
    drop.classList.add('over');
  });
  document.addEventListener('dragleave', (event) => { if (!event.relatedTarget) drop.classList.remove('over'); });
  document.addEventListener('drop', (event) => {
    if (!carries(event)) return;
    event.preventDefault();
    drop.classList.remove('over');
    add([...event.dataTransfer.files]);
    drop.scrollIntoView();
  });
  window.gonogo = { ...window.gonogo, judged: lines };
}
