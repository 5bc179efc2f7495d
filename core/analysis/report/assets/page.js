// Starts the sortable tables, the replay, and the curves with their controls and legend. Text from the results is only
// written with textContent.
'use strict';

(() => {
  const byId = (id) => document.getElementById(id);
  const make = (tag, properties = {}, ...children) => {
    const element = Object.assign(document.createElement(tag), properties);
    element.append(...children);
    return element;
  };

  // --- Curves ---
  const MOST_METHODS_WITH_BANDS = 6;
  const MOST_CHARTS_DRAWN_AT_ONCE = 12;
  const NEAR_PX = 600;  // distance from the viewport
  const TRACKS = [
    ['recommended', 'error at the recommended pose'],
    ['commanded', 'error at the commanded pose'],
    ['best', 'lowest measured error so far'],  // ranks stations: their first track
    ['measured', 'measured error (with camera noise)'],
    ['excess', 'error in excess of the own optimum'],
    ['recommended_best', 'error at the pose with the lowest measured error'],
    ['recommended_current', 'error at the current pose'],
  ];

  const CLOCKS = [['step', 'images'], ['machine_seconds', 'machine time, s'], ['algorithm_seconds', 'compute time, s']];

  const READOUT_HINT = 'Point at a line to read its values.';

  function drawCurves(data) {
    const methods = data.methods;
    if (methods.length === 0) {
      byId('curves-problem').hidden = false;
      byId('curves-problem').textContent = 'No trial finished, so there are no curves.';
      byId('cards').hidden = true;
      return 0;
    }
    const darkScheme = window.matchMedia('(prefers-color-scheme: dark)');
    const everyCurve = data.groups.flatMap((group) => group.curves);
    const hasBand = (key) => everyCurve.some((curve) => Object.values(curve.tracks).some((track) => (track[key] || []).some((value) => value !== null)));
    const bands = [['interval', '95 % intervals', 'lo95'], ['quartiles', 'quartiles', 'q25']].filter(([, , key]) => hasBand(key));
    bands.push(['none', 'no bands']);
    const view = {track: data.track || 'recommended', clock: 'step', log: true, logx: false, bands: methods.length <= MOST_METHODS_WITH_BANDS ? bands[0][0] : 'none',
                  visible: methods.map(() => true), dark: darkScheme.matches, styles: []};
    view.styles = relignCurves.styles(methods, view.dark);
    const charts = new Map();  // card element -> Chart, once drawn
    const cards = [...document.querySelectorAll('.card')];
    const legend = byId('legend');

    const count = () => { document.documentElement.dataset.curves = String(charts.size); };
    const updateAll = () => { for (const chart of charts.values()) chart.update(view); };

    function readout(card, group, index, place) {
      const line = card.querySelector('.readout');
      [...legend.children].forEach((item, i) => item.classList.toggle('lit', i === index));
      const curve = index === null || index < 0 ? null : relignCurves.curveIn(group, methods[index]);
      const values = curve && curve.tracks[view.track];
      if (!values || values.median[place] === undefined) {
        line.replaceChildren(make('span', {className: 'quiet', textContent: READOUT_HINT}));
        return;
      }
      const show = relignCurves.number;
      const range = (words, low, high) => (low && low[place] !== null ? '; ' + words + ' ' + show(low[place]) + '\u2013' + show(high[place]) : '');
      const seconds = (key, words) => (curve[key] && curve[key][place] !== null ? '; ' + show(curve[key][place]) + ' s ' + words : '');
      line.replaceChildren(make('b', {textContent: methods[index].label || methods[index].name}),
        ' image ' + relignCurves.stepAt(curve, place) + ': ' + show(values.median[place]) + range('95 %', values.lo95, values.hi95) +
        range('quartiles', values.q25, values.q75) + seconds('machine_seconds', 'machine time') + seconds('algorithm_seconds', 'compute time') +
        '; ' + (curve.trials === 1 ? '1 instance' : curve.trials + ' instances'));
    }

    function draw(card) {
      if (charts.has(card)) return;
      const group = data.groups[Number(card.dataset.group)];
      const place = card.querySelector('.chart');
      if (!group.curves.some((curve) => Object.keys(curve.tracks).length > 0)) {
        place.textContent = 'No trial finished in this group.';
        return;
      }
      place.classList.remove('waiting');
      charts.set(card, new relignCurves.Chart(place, group, methods, view,
        (index, step) => readout(card, group, index, step)));
      readout(card, group, null);
      count();
    }

    function swatch(style) {
      const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
      svg.setAttribute('width', '30');
      svg.setAttribute('height', '10');
      const line = document.createElementNS('http://www.w3.org/2000/svg', 'line');
      for (const [name, value] of Object.entries({x1: 0, x2: 30, y1: 5, y2: 5, 'stroke-width': 2.5, stroke: style.colour}))
        line.setAttribute(name, value);
      if (style.dash) line.setAttribute('stroke-dasharray', style.dash.join(' '));
      svg.append(line);
      return svg;
    }

    function fillLegend() {
      legend.replaceChildren(...methods.map((method, i) => {
        const box = make('input', {type: 'checkbox', checked: view.visible[i]});
        box.addEventListener('change', () => { view.visible[i] = box.checked; updateAll(); });
        const name = make('bdi', {textContent: method.label || method.name});
        const item = make('li', {}, make('label', {}, box, swatch(view.styles[i]), name, method.oracle ? ' (oracle)' : ''));
        item.addEventListener('mouseenter', () => { if (view.visible[i]) for (const chart of charts.values()) chart.highlight(i); });
        item.addEventListener('mouseleave', () => { for (const chart of charts.values()) chart.highlight(null); });
        return item;
      }));
    }

    function recolour(dark) {
      view.dark = dark;
      view.styles = relignCurves.styles(methods, dark);
      fillLegend();
      updateAll();
    }

    const present = TRACKS.filter(([id]) => data.groups.some((group) => group.curves.some((curve) => curve.tracks[id])));
    byId('track').replaceChildren(...present.map(([value, textContent]) => make('option', {value, textContent})));
    view.track = (present.find(([track]) => track === data.track) || present[0])[0];
    byId('track').value = view.track;
    byId('track').addEventListener('change', (event) => { view.track = event.target.value; updateAll(); });
    byId('scale').addEventListener('change', (event) => { view.log = event.target.value === 'log'; updateAll(); });
    byId('xscale').addEventListener('change', (event) => { view.logx = event.target.value === 'log'; updateAll(); });
    const options = (list) => list.map(([value, textContent]) => make('option', {value, textContent}));
    byId('bands').replaceChildren(...options(bands));
    byId('bands').value = view.bands;
    byId('bands').addEventListener('change', (event) => { view.bands = event.target.value; updateAll(); });
    const clocks = CLOCKS.filter(([key]) => key === 'step' || everyCurve.some((curve) => curve[key]));
    byId('clock').replaceChildren(...options(clocks));
    byId('clock').parentElement.hidden = clocks.length < 2;
    byId('clock').addEventListener('change', (event) => { view.clock = event.target.value; updateAll(); });
    const showEvery = (visible) => { view.visible.fill(visible); fillLegend(); updateAll(); };
    byId('all').addEventListener('click', () => showEvery(true));
    byId('none').addEventListener('click', () => showEvery(false));
    for (const id of ['controls', 'legend', 'curves-help']) byId(id).hidden = false;
    fillLegend();

    if (cards.length <= MOST_CHARTS_DRAWN_AT_ONCE) {
      cards.forEach(draw);
    } else {  // many: each when it comes near the viewport
      let waiting = cards;
      for (const card of cards) card.querySelector('.chart').classList.add('waiting');
      const drawNear = () => {
        waiting = waiting.filter((card) => {
          const box = card.getBoundingClientRect();
          const near = box.top < window.innerHeight + NEAR_PX && box.bottom > -NEAR_PX;
          if (near) draw(card);
          return !near;
        });
      };
      for (const what of ['scroll', 'resize']) window.addEventListener(what, drawNear, {passive: true});
      drawNear();
    }

    darkScheme.addEventListener('change', (event) => recolour(event.matches));
    // Paper is white and narrower than the screen.
    window.addEventListener('beforeprint', () => {
      cards.forEach(draw);
      recolour(false);
      for (const chart of charts.values()) chart.resize();
    });
    window.addEventListener('afterprint', () => {
      recolour(darkScheme.matches);
      for (const chart of charts.values()) chart.resize();
    });
    return charts.size;
  }

  // Print with all details open, except the gallery: the cards show the most important pictures.
  const closed = [];
  window.addEventListener('beforeprint', () => {
    for (const part of document.querySelectorAll('details:not([open]):not(.gallery):not(#licences)')) {
      part.open = true;
      closed.push(part);
    }
  });
  window.addEventListener('afterprint', () => {
    for (const part of closed.splice(0)) part.open = false;
  });

  const data = JSON.parse(byId('report-data').textContent);
  for (const {tracks} of data.groups.flatMap((group) => group.curves))
    for (const [name, track] of Object.entries(tracks)) if (typeof track === 'string') tracks[name] = tracks[track];  // an equal one
  relignSorting.start();
  relignReplay.start(data);
  try {
    document.documentElement.dataset.curves = String(drawCurves(data));
  } catch (problem) {
    byId('curves-problem').hidden = false;
    byId('curves-problem').textContent = 'The curves could not be drawn (' + problem.message + '); curves.csv has the same numbers.';
    document.documentElement.dataset.curves = 'failed';
  }
})();
