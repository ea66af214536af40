"""The script of the pages: values under the pointer, layers that can be hidden. Without it the page shows the same."""

SCRIPT = r"""
document.querySelectorAll('svg[data-figure]').forEach(svg => {
  const about = JSON.parse(svg.dataset.figure), holder = svg.parentNode, vertices = {};
  const bar = document.createElement('div'); bar.className = 'layers'; svg.after(bar);
  for (const [id, name] of Object.entries(about.layers)) {
    const label = document.createElement('label'), box = document.createElement('input');
    box.type = 'checkbox'; box.checked = true;
    box.onchange = () => { document.getElementById(id).style.display = box.checked ? '' : 'none'; };
    label.append(box, ' ' + name); bar.append(label);
  }
  if (!about.axes) return;
  const read = document.createElement('output'); read.className = 'readout'; bar.append(read);
  const [x0, x1, xa, xb] = about.axes.x, [y0, y1, ya, yb] = about.axes.y;
  const mark = document.createElementNS(svg.namespaceURI, 'circle');
  mark.setAttribute('r', 4); mark.setAttribute('fill', 'none'); mark.setAttribute('stroke', '#222');
  mark.style.display = 'none'; svg.append(mark);
  const points = id => vertices[id] ??= (() => {
    const layer = document.getElementById(id), uses = [...layer.querySelectorAll('use')];
    if (uses.length) return uses.map(u => [+u.getAttribute('x'), +u.getAttribute('y')]);
    return [...layer.querySelectorAll('path')].flatMap(p =>
      [...p.getAttribute('d').matchAll(/[ML]\s*(-?[\d.]+)[ ,]+(-?[\d.]+)/g)].map(m => [+m[1], +m[2]]));
  })();
  const value = (label, number) => { const [, name, unit] = label.match(/^(.*?)\s*(?:\[(.*)\])?$/);
    return name + ' ' + Number(number.toPrecision(4)) + (unit ? ' ' + unit : ''); };
  const show = event => {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    let best = null, reach = 144;
    for (const [id, name] of Object.entries(about.layers)) {
      if (document.getElementById(id).style.display === 'none') continue;
      for (const [x, y] of points(id)) {
        const far = (x - at.x) ** 2 + (y - at.y) ** 2;
        if (far < reach && x >= x0 && x <= x1) { reach = far; best = [x, y, name]; }
      }
    }
    const [x, y, name] = best || [at.x, at.y, ''];
    if (x < x0 || x > x1 || y > y0 || y < y1) { clear(); return; }
    mark.style.display = best ? '' : 'none'; mark.setAttribute('cx', x); mark.setAttribute('cy', y);
    read.textContent = (name ? name + ': ' : '') + value(about.axes.xlabel, xa + (x - x0) / (x1 - x0) * (xb - xa)) +
      ', ' + value(about.axes.ylabel, ya + (y - y0) / (y1 - y0) * (yb - ya));
  };
  const clear = () => { read.textContent = ''; mark.style.display = 'none'; };
  svg.addEventListener('pointermove', show); svg.addEventListener('pointerdown', show);
  svg.addEventListener('pointerleave', clear);
});
document.querySelectorAll('.command').forEach(code => {
  if (!navigator.clipboard) return;
  const copy = document.createElement('button'); copy.textContent = 'copy';
  copy.onclick = () => navigator.clipboard.writeText(code.textContent).then(() => { copy.textContent = 'copied'; });
  code.after(' ', copy);
});
"""
