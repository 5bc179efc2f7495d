// Charts as SVG from declarative specifications, as chart_json (svg_chart.h) writes them:
//   {title, x: AXIS, y: AXIS, series: [{name, style, drawn, x, y, low, high}], levels: [{label, y, dotted}], height}
//   AXIS: {title, log, whole, categories, low, high}; drawn: line, steps, marks, marked_line
//   {title, map: {across: {name, unit, values}, up: {...}, rmse, score}}: a colour map
// A chart has the colours of the page; a saved one has those of the files of 'report --figures', on white.
'use strict';

const relignChart = (() => {
  const {make, svg, known, number} = relign;
  const COLOURS = ['#0072B2', '#D55E00', '#009E73', '#B5598E', '#B97F00', '#2E94CC', '#3A3F47'];  // page.css: also for dark mode
  const DASHES = ['', '8 4', '2 3', '10 3 2 3', '14 4', '5 2 1 2 1 2'];
  const VIRIDIS = ['#440154', '#482878', '#3e4989', '#31688e', '#26828e', '#1f9e89', '#35b779', '#6ece58', '#b5de2b', '#fde725'];
  const INK = '#3a3f47', ORACLE = '#6a7380';
  const LEFT = 54, BOTTOM = 42, MARGIN = 8, TITLE = 22, LABEL_HEIGHT = 12, CHARACTER = 6.1, LABEL_CHARACTERS = 20;
  const WIDTH = 460, NARROW = 300, WIDE = 860, REACH = 40;  // pixels

  const clipped = (text, most) => ([...text].length <= most ? text : [...text].slice(0, Math.max(1, most - 3)).join('') + '...');
  const dashOf = (style) => (style < 0 ? '4 4' : DASHES[Math.floor(style / COLOURS.length) % DASHES.length]);
  const classOf = (style) => (style < 0 ? 's-oracle' : 's' + style % COLOURS.length);
  const colourOf = (style) => (style < 0 ? ORACLE : COLOURS[style % COLOURS.length]);
  const tick = (value) => String(Number(value.toPrecision(6)));

  function roundStep(least) {
    const power = 10 ** Math.floor(Math.log10(least));
    return power * ([1, 2, 5].find((factor) => factor * power >= least * (1 - 1e-9)) || 10);
  }

  // About `count` round numbers within the axis.
  function marks(low, high, log, count, whole) {
    const list = [], decades = Math.log10(high / low);
    if (!log || decades < 0.8) {
      const step = Math.max(roundStep((high - low) / count), whole ? 1 : 0);
      for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) list.push(k * step);
      return list;
    }
    const factors = decades < 2.2 ? [1, 2, 5] : [1], every = factors.length > 1 ? 1 : Math.ceil(decades / count);
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); ++power)
      for (const value of power % every ? [] : factors.map((factor) => factor * 10 ** power))
        if (value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9) && (!whole || value > 1 - 1e-9)) list.push(value);
    return list;
  }

  // Positions in pixels; values without one on a logarithmic axis are at its end.
  function scale([low, high, log], from, to) {
    const place = (value) => (log ? Math.log10(value) : value), a = place(low), b = place(high);
    return {at: (value) => from + (to - from) * ((log && !(value > 0) ? a : place(value)) - a) / (b - a),
            value: (pixel) => { const x = a + (b - a) * (pixel - from) / (to - from); return log ? 10 ** x : x; },
            marks: (count, whole) => marks(low, high, log, count, whole).map((value) => [value, tick(value)])};
  }

  // [low, high, logarithmic], from the values unless the specification sets it.
  function rangeOf(axis, values, airy) {
    if (axis.categories) return [-0.5, axis.categories.length - 0.5, false];
    const positive = values.filter((value) => value > 0), log = Boolean(axis.log) && positive.length > 0;
    let low = Infinity, high = -Infinity;
    for (const value of log ? positive : values) if (known(value)) { low = Math.min(low, value); high = Math.max(high, value); }
    if (low > high) [low, high] = [0, 1];
    if (log) {
      if (high < low * 1.5) { low /= 1.5; high *= 1.5; }
      const air = airy ? (high / low) ** 0.05 : 1;
      low /= air; high *= air;
    } else {
      if (airy && low > 0) low = 0;
      if (!(high > low)) high = low + Math.max(1, Math.abs(low));
      if (airy) high += 0.05 * (high - low);
    }
    if (known(axis.low) && (!log || axis.low > 0)) low = axis.low;
    if (known(axis.high) && axis.high > low) high = axis.high;
    return [low, high, log];
  }

  // Positions of labels near those wanted, without overlap; the first ones have priority.
  function spread(labels, top, bottom) {
    const kept = labels.slice(0, Math.max(0, Math.floor((bottom - top) / LABEL_HEIGHT) + 1)).sort((a, b) => a.y - b.y);
    let least = top, most = bottom;
    for (const label of kept) { label.place = Math.max(label.y, least); least = label.place + LABEL_HEIGHT; }
    for (const label of [...kept].reverse()) { label.place = Math.min(label.place, most); most = label.place - LABEL_HEIGHT; }
    return kept;
  }

  const path = (d, look) => svg('path', {d, fill: 'none', stroke: 'currentColor', ...look});
  const pixels = (...values) => values.map((value) => Math.round(10 * value) / 10).join(' ');

  class Drawing {
    constructor(spec, width, {alone = false, zoom = {}} = {}) {
      Object.assign(this, {spec, width, alone, height: spec.height || 280, hits: []});
      this.root = svg('svg', {class: 'figure', viewBox: pixels(0, 0, width, this.height), role: 'img', 'aria-label': spec.title, 'font-size': '11', fill: 'none'});
      if (alone) {
        for (const [name, value] of Object.entries({xmlns: 'http://www.w3.org/2000/svg', width, height: this.height, 'font-family': 'Helvetica, Arial, sans-serif'}))
          this.root.setAttribute(name, value);
        this.root.append(svg('rect', {width, height: this.height, fill: '#ffffff'}),
          this.group('axis', INK, this.text(LEFT, MARGIN + 11, spec.title, 'start', {'font-weight': '600', 'font-size': '13'})));
      }
      this.top = MARGIN + (alone ? TITLE : 0);
      this.bottom = this.height - BOTTOM;
      if (spec.map) this.drawMap(spec.map);
      else this.drawChart(zoom);
    }

    group(name, colour, ...children) { return svg('g', this.alone ? {color: colour} : {class: name}, ...children); }
    ofSeries(series, ...children) { return this.group(classOf(series.style), colourOf(series.style), ...children); }
    text(x, y, words, anchor, more = {}) { return svg('text', {x, y, fill: 'currentColor', 'text-anchor': anchor, ...more}, words); }

    drawChart(zoom) {
      const {spec} = this, longest = Math.max(0, ...spec.series.map((one) => [...one.name].length));
      this.right = this.width - MARGIN - 8 - CHARACTER * Math.min(longest, LABEL_CHARACTERS);
      const values = spec.series.flatMap((one) => [...one.y, ...(one.low || []), ...(one.high || [])]);
      this.ranges = {x: zoom.x || rangeOf(spec.x, spec.series.flatMap((one) => one.x), false),
                     y: zoom.y || rangeOf(spec.y, [...values, ...spec.levels.map((level) => level.y)], true)};
      this.x = scale(this.ranges.x, LEFT, this.right);
      this.y = scale(this.ranges.y, this.bottom, this.top);
      // Clipped to the axes, with room for marks at their ends.
      const area = {x: LEFT - 4, y: this.top - 4, width: this.right - LEFT + 8, height: this.bottom - this.top + 8};
      const data = svg('svg', {...area, viewBox: pixels(area.x, area.y, area.width, area.height)});
      this.drawAxes(spec.x.categories ? spec.x.categories.map((name, i) => [i, name]) : this.x.marks(Math.floor((this.right - LEFT) / 45), spec.x.whole), this.y.marks(6, spec.y.whole));
      this.root.append(data);
      data.append(...spec.series.flatMap((one) => this.band(one)));  // below all lines
      for (const level of spec.levels) this.drawLevel(data, level);
      this.lines = spec.series.map((one, i) => this.ofSeries(one, ...this.line(one, i)));
      data.append(...[...this.lines].reverse());
      this.root.append(...this.endLabels());
    }

    drawAxes(xMarks, yMarks) {
      const {top, bottom, right, spec} = this, room = Math.max(4, Math.floor((right - LEFT) / xMarks.length / CHARACTER));
      let grid = '', frame = `M${pixels(LEFT, top)}V${pixels(bottom)}H${pixels(right)}`;
      const axis = this.group('axis', INK);
      for (const [value, words] of xMarks) {
        frame += `M${pixels(this.x.at(value), bottom)}v4`;
        axis.append(this.text(this.x.at(value), bottom + 16, spec.x.categories ? clipped(words, room) : words, 'middle'));
      }
      for (const [value, words] of yMarks) {
        grid += `M${pixels(LEFT, this.y.at(value))}H${pixels(right)}`;
        axis.append(this.text(LEFT - 6, this.y.at(value) + 4, words, 'end'));
      }
      const middle = (top + bottom) / 2;
      axis.append(path(grid, {'stroke-opacity': '0.18'}), path(frame, {'stroke-opacity': '0.6'}),
        this.text((LEFT + right) / 2, bottom + 33, spec.x.title, 'middle'),
        this.text(11, middle, spec.y.title, 'middle', {transform: `rotate(-90 11 ${pixels(middle)})`}));
      this.root.append(axis);
    }

    // Marks of one category are placed side by side.
    place(series, index, k) {
      const {categories} = this.spec.x, count = this.spec.series.length, x = this.x.at(series.x[k]);
      if (!categories || count < 2) return x;
      return x + (index - (count - 1) / 2) * Math.min(9, 0.7 * (this.right - LEFT) / categories.length / count);
    }

    band(series) {
      if (series.drawn.startsWith('mark') || !series.low) return [];
      const upper = [], lower = [];
      series.x.forEach((x, k) => {
        if (!known(series.low[k]) || !known(series.high[k])) return;
        upper.push(pixels(this.x.at(x), this.y.at(series.high[k])));
        lower.unshift(pixels(this.x.at(x), this.y.at(series.low[k])));
      });
      return upper.length > 0 ? [this.ofSeries(series, svg('path', {d: `M${[...upper, ...lower].join('L')}Z`, fill: 'currentColor', 'fill-opacity': '0.14'}))] : [];
    }

    line(series, index) {
      let d = '', bars = '', down = false;
      const dots = [];
      series.x.forEach((value, k) => {
        if (!known(value) || !known(series.y[k])) { down = false; return; }
        const x = this.place(series, index, k), y = this.y.at(series.y[k]);
        this.hits.push({index, k, x, y});
        d += !down ? 'M' + pixels(x, y) : series.drawn === 'steps' ? `H${pixels(x)}V${pixels(y)}` : 'L' + pixels(x, y);
        down = true;
        if (!series.drawn.startsWith('mark')) return;
        dots.push(svg('circle', {cx: x, cy: y, r: 3, fill: 'currentColor'}));
        if (series.low && known(series.low[k]) && known(series.high[k])) bars += `M${pixels(x, this.y.at(series.low[k]))}V${pixels(this.y.at(series.high[k]))}`;
      });
      const drawn = series.drawn === 'marks' ? [] : [path(d, {'stroke-width': '1.7', 'stroke-dasharray': dashOf(series.style)})];
      return [svg('title', {}, series.name), ...drawn, ...dots, ...(bars ? [path(bars, {'stroke-width': '1.4'})] : [])];
    }

    drawLevel(data, level) {
      if (!known(level.y)) return;
      const y = this.y.at(level.y);
      // Below its line if the label of another line is close above.
      const crowded = this.spec.levels.some((other) => { const gap = y - this.y.at(other.y); return gap > 0 && gap < LABEL_HEIGHT; });
      data.append(this.group('axis', INK, path(`M${pixels(LEFT, y)}H${pixels(this.right)}`, {'stroke-dasharray': level.dotted ? '1.5 3' : '7 4'}),
        this.text(LEFT + 4, crowded || y < this.top + 8 ? y + 10 : y - 3, level.label, 'start', {'font-size': '10'})));
    }

    endLabels() {
      const [low, high] = this.ranges.x, wanted = [];
      for (const series of this.spec.series) {
        const k = series.x.map((x, i) => known(series.y[i]) && x >= low && x <= high).lastIndexOf(true);
        const y = k < 0 ? NaN : this.y.at(series.y[k]);
        if (y >= this.top - 1 && y <= this.bottom + 1) wanted.push({series, y});
      }
      return spread(wanted, this.top + 4, this.bottom).map(({series, y, place}) => this.ofSeries(series,
        path(`M${pixels(this.right + 1, y)}L${pixels(this.right + 6, place)}`, {'stroke-opacity': '0.6'}),
        this.text(this.right + 8, place + 3.5, clipped(series.name, LABEL_CHARACTERS), 'start')));
    }

    // A value per cell, which the browser interpolates. Dark is low; colours stay distinguishable in greyscale.
    drawMap({across, up, rmse, score}) {
      const columns = across.values.length, rows = up.values.length, low = Math.min(...rmse), high = Math.max(...rmse);
      const shade = (value) => VIRIDIS[Math.min(VIRIDIS.length - 1, Math.floor(VIRIDIS.length * (value - low) / (high - low || 1)))];
      const canvas = make('canvas', {width: columns, height: rows}), context = canvas.getContext('2d');
      rmse.forEach((value, i) => { context.fillStyle = shade(value); context.fillRect(i % columns, rows - 1 - Math.floor(i / columns), 1, 1); });
      const side = Math.min(this.bottom - this.top, this.width - LEFT - 90);
      Object.assign(this, {right: LEFT + side, bottom: this.top + side, spec: {...this.spec, x: {title: across.name + ' / ' + across.unit}, y: {title: up.name + ' / ' + up.unit}}});
      this.x = scale([across.values[0], across.values[columns - 1], false], LEFT, this.right);
      this.y = scale([up.values[0], up.values[rows - 1], false], this.bottom, this.top);
      this.root.append(svg('image', {x: LEFT, y: this.top, width: side, height: side, preserveAspectRatio: 'none', href: canvas.toDataURL()}));
      this.drawAxes(this.x.marks(4), this.y.marks(4));
      const step = side / VIRIDIS.length, bar = this.right + 22;
      this.root.append(...VIRIDIS.map((fill, i) => svg('rect', {x: bar, y: this.bottom - (i + 1) * step, width: 14, height: step, fill})),
        this.group('axis', INK, this.text(bar + 19, this.bottom, number(low), 'start'), this.text(bar + 19, this.top + 9, number(high), 'start'),
          this.text(bar, this.bottom + 16, score, 'start')));
    }
  }

  // --- Saving ---
  const fileName = (text) => text.replace(/[^A-Za-z0-9._]+/g, '-').replace(/^-+|[-.]+$/g, '').slice(0, 60) || 'chart';
  const download = (name, href) => make('a', {href, download: name}).click();
  // XML has no control characters, which names may contain.
  const svgUri = (spec) => 'data:image/svg+xml;charset=utf-8,' +
    encodeURIComponent(new XMLSerializer().serializeToString(new Drawing(spec, WIDTH + 120, {alone: true}).root).replace(/[\u0000-\u0008\u000b-\u001f\ufffe\uffff]/g, '\ufffd'));

  function savePng(spec, name) {
    const picture = new Image();
    picture.onload = () => {
      const canvas = make('canvas', {width: 3 * picture.width, height: 3 * picture.height});
      canvas.getContext('2d').drawImage(picture, 0, 0, canvas.width, canvas.height);
      download(name + '.png', canvas.toDataURL('image/png'));
    };
    picture.src = svgUri(spec);
  }

  class Chart {
    // `name`: of saved files. describe(series, point): the readout, [name, text].
    constructor(place, spec, {name = 'chart', describe = null} = {}) {
      Object.assign(this, {place, name, zoom: {}, lit: null, describe: describe || ((i, k) => this.values(i, k))});
      this.frame = make('div', {className: 'frame', tabIndex: 0});
      this.readout = make('p', {className: 'readout', ariaLive: 'polite'});
      const save = (format, act) => {
        const button = make('button', {type: 'button', textContent: format, title: `Save this chart as ${format}`});
        button.addEventListener('click', act);
        return button;
      };
      place.replaceChildren(this.frame, make('div', {className: 'under'}, this.readout, make('span', {className: 'save noprint'},
        save('SVG', () => download(fileName(this.name) + '.svg', svgUri(this.spec))), save('PNG', () => savePng(this.spec, fileName(this.name))))));
      this.set(spec);
      this.listen();
      new ResizeObserver(() => requestAnimationFrame(() => { if (Math.abs(this.frame.clientWidth - this.measured) > 4) this.draw(); })).observe(this.frame);
    }

    set(spec, keepZoom = false) {
      this.spec = spec;
      if (!keepZoom) this.zoom = {};
      this.draw();
    }

    draw() {
      this.measured = this.frame.clientWidth;
      this.drawing = new Drawing(this.spec, Math.min(WIDE, Math.max(NARROW, this.measured || WIDTH)), {zoom: this.zoom});
      this.frame.replaceChildren(this.drawing.root);
      this.point(null);
    }

    highlight(index) {
      if (!this.drawing.lines) return;
      this.lit = index;
      this.drawing.lines.forEach((line, i) => { line.classList.toggle('lit', i === index); line.classList.toggle('dim', index !== null && i !== index); });
    }

    values(i, k) {
      const {x, series} = this.spec, {name, y, low, high, x: xs} = series[i];
      const interval = low && known(low[k]) && known(high[k]) ? ` (${number(low[k])}\u2013${number(high[k])})` : '';
      return [name, ` ${x.categories ? x.categories[xs[k]] : x.title + ' ' + tick(xs[k])}: ${number(y[k])}${interval}`];
    }

    point(hit) {
      this.at = hit;
      this.highlight(hit && hit.index);
      if (this.dot) this.dot.remove();
      if (!hit) {
        this.readout.textContent = this.drawing.hits.length > 0 ? 'Point at a line to read its values.' : '';
        return;
      }
      this.dot = svg('circle', {class: classOf(this.spec.series[hit.index].style), cx: hit.x, cy: hit.y, r: 4.5, fill: 'currentColor'});
      this.drawing.root.append(this.dot);
      const [name, text] = this.describe(hit.index, hit.k);
      this.readout.replaceChildren(make('b', {textContent: name}), text);
    }

    // In the units of the drawing.
    position(event) {
      const box = this.drawing.root.getBoundingClientRect();
      return {x: (event.clientX - box.left) * this.drawing.width / box.width, y: (event.clientY - box.top) * this.drawing.height / box.height};
    }

    nearest({x, y}) {
      let best = null, least = REACH ** 2;
      for (const hit of this.drawing.hits) {
        const away = (hit.x - x) ** 2 + (hit.y - y) ** 2;
        if (away < least) [best, least] = [hit, away];
      }
      return best;
    }

    listen() {
      let from = null, box = null;
      this.frame.addEventListener('pointerdown', (event) => { if (this.drawing.ranges && event.pointerType === 'mouse') { from = this.position(event); event.preventDefault(); this.frame.focus({preventScroll: true}); } });
      this.frame.addEventListener('pointermove', (event) => {
        const to = this.position(event);
        if (!from) return this.point(this.nearest(to));
        if (!box) this.drawing.root.append(box = svg('rect', {class: 'zoom'}));
        const {top, bottom} = this.drawing, wide = Math.abs(to.x - from.x) >= Math.abs(to.y - from.y);
        const {right} = this.drawing, area = wide ? {x: Math.min(from.x, to.x), width: Math.abs(to.x - from.x), y: top, height: bottom - top}
          : {x: LEFT, width: right - LEFT, y: Math.min(from.y, to.y), height: Math.abs(to.y - from.y)};
        for (const [name, value] of Object.entries(area)) box.setAttribute(name, value);
      });
      window.addEventListener('pointerup', (event) => {
        if (from && box) this.zoomTo(from, this.position(event));
        from = box = null;
      });
      this.frame.addEventListener('pointerleave', () => { if (!from) this.point(null); });
      this.frame.addEventListener('dblclick', () => this.zoomTo(null));
      this.frame.addEventListener('keydown', (event) => this.key(event));
    }

    zoomTo(from, to) {
      if (!from) this.zoom = {};
      else {
        const name = Math.abs(to.x - from.x) >= Math.abs(to.y - from.y) ? 'x' : 'y', axis = this.drawing[name];
        if (Math.abs(to[name] - from[name]) < 8 || this.spec[name].categories) return this.draw();
        const ends = [axis.value(from[name]), axis.value(to[name])].sort((a, b) => a - b);
        this.zoom = {...this.zoom, [name]: [...ends, this.drawing.ranges[name][2]]};
      }
      this.draw();
    }

    // Arrows left and right follow a line, up and down change it.
    key(event) {
      const {hits} = this.drawing, at = this.at || hits[0], along = hits.filter((hit) => at && hit.index === at.index);
      if (event.key === 'Escape') { this.zoomTo(null); return; }
      if (!at) return;
      const other = (by) => { const names = [...new Set(hits.map((hit) => hit.index))], to = names[names.indexOf(at.index) + by]; return hits.filter((hit) => hit.index === to).sort((a, b) => Math.abs(a.x - at.x) - Math.abs(b.x - at.x))[0]; };
      const place = along.indexOf(at), to = {ArrowLeft: () => along[place - 1], ArrowRight: () => along[place + 1], Home: () => along[0],
                                             End: () => along[along.length - 1], ArrowUp: () => other(-1), ArrowDown: () => other(1)}[event.key];
      if (!to) return;
      event.preventDefault();
      this.point(to() || at);
    }
  }

  return {Chart, classOf, dashOf};
})();
