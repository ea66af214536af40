'use strict';
// Runs the drive's model, the C of the FMU compiled to WebAssembly, and draws torque over twist.
(async () => {
  const el = id => document.getElementById(id);
  const data = JSON.parse(el('drive-data').textContent);
  const bytes = Uint8Array.from(atob(el('drive-module').textContent.trim()), c => c.charCodeAt(0));
  const drive = (await WebAssembly.instantiate(bytes, {})).instance.exports;
  if (drive._initialize) drive._initialize();
  const ARCMIN = Math.PI / 10800, FRAME = 1 / 60;
  const at = data.references, range = data.range;
  const values = () => new Float64Array(drive.memory.buffer, drive.values(), data.count);
  const parameters = new Map(data.parameters.map(p => [p.name, p.value]));

  // The inputs of the drive: crank and twist, rad, with the speeds of a step of dt seconds from the inputs before.
  function inputs(twist, crank, dt) {
    const v = values(), output = crank / data.ratio - twist;
    v[at['crank.w']] = dt ? (crank - v[at['crank.phi']]) / dt : 0;
    v[at['output.w']] = dt ? (output - v[at['output.phi']]) / dt : 0;
    v[at['crank.phi']] = crank;
    v[at['output.phi']] = output;
  }

  function start(twist, crank) {
    const v = values();
    for (const p of data.parameters) v[p.reference] = parameters.get(p.name);
    inputs(twist, crank, 0);
    return drive.initialise();
  }

  const result = name => values()[at[name]];

  // A fixed motion, for comparison with the FMU: corners of the twist, a turning crank, changed parameters.
  function selfTest() {
    const rows = [], corners = [0, 0.05, -0.05, 0.3, -0.3, 1, -1, 0.4, 1.1, 0], steps = 20;
    drive.reset();
    let crank = 0.2;
    start(0, crank);
    for (let leg = 1; leg < corners.length; leg++)
      for (let k = 1; k <= steps; k++) {
        const share = k / steps, dt = [1e-3, 0.02, 2.5e-3][k % 3];
        crank += 0.05;
        inputs((corners[leg - 1] + (corners[leg] - corners[leg - 1]) * share) * data.twist, crank, dt);
        const u = Array.from(data.inputs, name => result(name));
        if (!drive.step(dt)) throw new Error('no finite result');
        rows.push({dt, u, y: Array.from(data.outputs, name => result(name))});
      }
    return rows;
  }

  if (location.hash.startsWith('#selftest')) {
    for (const [name, value] of new URLSearchParams(location.hash.slice('#selftest'.length)))
      parameters.set(name, Number(value));
    const pre = document.createElement('pre');
    pre.id = 'selftest';
    pre.textContent = JSON.stringify(selfTest());
    document.body.append(pre);
  }

  const state = {twist: 0, crank: 0, trace: [], rest: [], loop: null};
  const styles = getComputedStyle(document.documentElement);
  const colour = name => styles.getPropertyValue(name);

  function restCurve() {
    state.rest = [];
    for (let k = 0; k <= 160; k++) {
      const twist = (k / 80 - 1) * range;
      if (start(twist, state.crank)) state.rest.push([twist, result('output.tau')]);
    }
  }

  function restart() {
    drive.reset();
    restCurve();
    start(state.twist, state.crank);
    state.trace = [[state.twist, result('output.tau')]];
    show();
  }

  function moveTo(twist, dt) {
    state.twist = Math.max(-range, Math.min(range, twist));
    inputs(state.twist, state.crank, dt);
    if (drive.step(dt)) state.trace.push([state.twist, result('output.tau')]);
    if (state.trace.length > 4000) state.trace.shift();
  }

  // From the present twist to another one within a frame, in short steps, so that a loop is drawn without corners.
  function glide(to) {
    const from = state.twist, n = Math.max(1, Math.min(40, Math.ceil(Math.abs(to - from) / (range / 200))));
    for (let k = 1; k <= n; k++) moveTo(from + (to - from) * k / n, FRAME / n);
    show();
  }

  function show() {
    el('twist-slider').value = state.twist / ARCMIN;
    const texts = {twist: [state.twist / ARCMIN, 3], torque: [result('output.tau'), 2],
      stiffness: [result('stiffness') * ARCMIN, 3], force: [result('max_contact_force'), 0],
      share: [100 * result('load_share'), 1]};
    for (const [name, [value, digits]] of Object.entries(texts))
      if (el('read-' + name)) el('read-' + name).textContent = value.toFixed(digits);
    draw();
  }

  const canvas = el('plot'), pen = canvas.getContext('2d');
  const box = () => ({left: 58, right: canvas.clientWidth - 12, top: 10, bottom: canvas.clientHeight - 40});

  function draw() {
    const ratio = window.devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight, b = box();
    if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
      canvas.width = Math.round(w * ratio);
      canvas.height = Math.round(h * ratio);
    }
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, w, h);
    const greatest = 1.05 * Math.max(1e-9, ...state.rest.map(p => Math.abs(p[1])), ...state.trace.map(p => Math.abs(p[1])));
    const x = twist => b.left + (twist / range + 1) / 2 * (b.right - b.left);
    const y = torque => b.top + (1 - torque / greatest) / 2 * (b.bottom - b.top);
    const tick = top => { const p = 10 ** Math.floor(Math.log10(top)); return [0.2, 0.5, 1, 2, 5].map(m => m * p).find(s => top / s <= 5); };
    pen.font = '12px system-ui, sans-serif';
    pen.lineWidth = 1;
    pen.strokeStyle = colour('--grid');
    pen.fillStyle = colour('--text');
    const line = (x0, y0, x1, y1) => { pen.beginPath(); pen.moveTo(x0, y0); pen.lineTo(x1, y1); pen.stroke(); };
    const number = value => String(Number(value.toPrecision(6)));
    pen.textAlign = 'center';
    const dx = tick(range / ARCMIN), dy = tick(greatest);
    for (let k = -5; k <= 5; k++) if (Math.abs(k * dx) <= range / ARCMIN) {
      line(x(k * dx * ARCMIN), b.top, x(k * dx * ARCMIN), b.bottom);
      pen.fillText(number(k * dx), x(k * dx * ARCMIN), b.bottom + 16);
    }
    pen.fillText('twist [arcmin]', (b.left + b.right) / 2, b.bottom + 34);
    pen.textAlign = 'right';
    for (let k = -5; k <= 5; k++) if (Math.abs(k * dy) <= greatest) {
      line(b.left, y(k * dy), b.right, y(k * dy));
      pen.fillText(number(k * dy), b.left - 6, y(k * dy) + 4);
    }
    pen.save();
    pen.translate(12, (b.top + b.bottom) / 2);
    pen.rotate(-Math.PI / 2);
    pen.textAlign = 'center';
    pen.fillText('torque [N.m]', 0, 0);
    pen.restore();
    const curve = (points, style, width) => {
      pen.beginPath();
      points.forEach(([u, v], k) => k ? pen.lineTo(x(u), y(v)) : pen.moveTo(x(u), y(v)));
      pen.strokeStyle = colour(style);
      pen.lineWidth = width;
      pen.stroke();
    };
    curve(state.rest, '--rest', 2);
    curve(state.trace, '--curve', 2);
    pen.beginPath();
    pen.arc(x(state.twist), y(result('output.tau')), 5, 0, 7);
    pen.fillStyle = colour('--curve');
    pen.fill();
  }

  const stop = () => { state.loop = null; };
  el('twist-slider').addEventListener('input', event => { stop(); glide(event.target.value * ARCMIN); });
  const drag = event => {
    if (event.type === 'pointermove' && !event.buttons) return;
    if (event.type === 'pointerdown') canvas.setPointerCapture(event.pointerId);
    const b = box();
    stop();
    glide(((event.clientX - canvas.getBoundingClientRect().left - b.left) / (b.right - b.left) * 2 - 1) * range);
  };
  canvas.addEventListener('pointerdown', drag);
  canvas.addEventListener('pointermove', drag);
  if (el('crank-slider')) el('crank-slider').addEventListener('input', event => {
    stop();
    state.crank = event.target.value * Math.PI / 180;
    restart();
  });
  function runLoop() {
    const amplitude = Math.min(range, Math.abs(el('loop-size').value) * ARCMIN);
    state.loop = {corners: [amplitude, -amplitude, amplitude, -amplitude, amplitude], speed: 4 * amplitude / 2};
    requestAnimationFrame(turn);
  }
  el('run-loop').addEventListener('click', runLoop);
  function turn() {
    const loop = state.loop;
    if (!loop) return;
    let left = loop.speed * FRAME;
    while (left > 0 && loop.corners.length) {
      const way = loop.corners[0] - state.twist, part = Math.min(left, Math.abs(way));
      glide(state.twist + Math.sign(way) * part);
      left -= part;
      if (part >= Math.abs(way)) loop.corners.shift(); else break;
    }
    if (loop.corners.length) requestAnimationFrame(turn); else stop();
  }
  el('clear').addEventListener('click', () => { stop(); restart(); });
  const fields = document.querySelectorAll('input[data-parameter]');
  for (const field of fields)
    field.addEventListener('change', () => {
      const value = Number(field.value), low = Number(field.min), high = Number(field.max);
      const given = field.value.trim() !== '' && Number.isFinite(value);
      const kept = given ? Math.max(low, Math.min(high, value)) : Number(field.defaultValue);
      field.value = kept;
      parameters.set(field.dataset.parameter, kept * Number(field.dataset.size));
      stop();
      restart();
    });
  el('defaults').addEventListener('click', () => {
    for (const p of data.parameters) parameters.set(p.name, p.value);
    for (const field of fields) field.value = field.defaultValue;
    stop();
    restart();
  });
  new ResizeObserver(draw).observe(canvas);
  restart();
  if (!location.hash && !matchMedia('(prefers-reduced-motion: reduce)').matches) runLoop();
})().catch(error => {
  document.getElementById('drive-error').textContent = 'The drive cannot run in this browser: ' + error.message;
});
